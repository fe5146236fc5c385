"""How kernels are compiled, in one place.

LLVM cannot prove that the arrays of a kernel do not overlap, so a loop that gathers from one and stores to another stays
scalar. ``inner_loop`` compiles such a function with every array argument marked as not overlapping, through a private
hook of numba; ``noalias_active`` says whether this numba still has that hook. Without it the answers are the same and
the fast sweep takes about twice as long.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import dispatcher as numba_dispatcher

__all__ = ["FASTMATH", "inner_loop", "noalias_active", "parallel_kernel", "scalar_kernel"]

# The default layer aborts the process when two threads call parallel kernels at once; OpenMP and TBB do not.
numba.config.THREADING_LAYER = "threadsafe"
numba.config.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]

# NaN means "unknown" here, so the flags that let the compiler assume there are none ("nnan", "ninf") stay out.
FASTMATH = frozenset({"nsz", "arcp", "contract", "afn"})

scalar_kernel = numba.njit(cache=True, error_model="numpy")
parallel_kernel = numba.njit(cache=True, error_model="numpy", parallel=True)

_FunctionCompiler = getattr(numba_dispatcher, "_FunctionCompiler", None)

if _FunctionCompiler is not None:

    class _NoAliasCompiler(_FunctionCompiler):  # type: ignore[misc, valid-type]
        """numba's function compiler with the noalias flag set."""

        def _customize_flags(self, flags: Any) -> Any:
            flags.noalias = True
            return flags


def inner_loop(function: Callable[..., Any]) -> Any:
    """Compile an inner loop whose array arguments never overlap."""
    compiled = numba.njit(cache=True, error_model="numpy", fastmath=set(FASTMATH))(function)
    if noalias_active():
        compiled._compiler.__class__ = _NoAliasCompiler
    return compiled


def noalias_active() -> bool:
    """Whether this numba has the hook through which arrays are marked as not overlapping."""
    return _FunctionCompiler is not None and hasattr(_FunctionCompiler, "_customize_flags")
