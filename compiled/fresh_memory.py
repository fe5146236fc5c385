"""Fresh memory, made ready by all threads, each a stretch of its own."""

import numpy as np
from numba import prange

from compiled.options import parallel_kernel

__all__ = ["take_pages"]

PAGE = 1024  # float32 in the smallest page of memory


@parallel_kernel
def take_pages(fresh, stretches):
    """Write once into each page of fresh (n,) float32, which the system hands out, zeroed, when it is first written.

    Two threads that come to a fresh page at the same time both zero it, and one does so in vain; the threads of a sweep
    do it all the time.
    """
    each = fresh.shape[0] // stretches + 1
    for stretch in prange(stretches):
        for i in range(stretch * each, min((stretch + 1) * each, fresh.shape[0]), PAGE):
            fresh[i] = np.float32(0.0)
