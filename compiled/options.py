"""How kernels are compiled, in one place, for every package.

LLVM cannot prove that the arrays of a kernel do not overlap, so a loop that gathers from one and stores to another
stays scalar. ``inner_loop`` compiles such a function with every array argument marked as not overlapping, through a
private hook of numba; ``noalias_active`` says whether this numba still has that hook. Without it the answers are the
same and the fast sweep takes about twice as long.

Compiled kernels are kept on disk. numba notices when a kernel's own file changes, but not when a kernel that was
compiled into it does; so the folder they are kept in carries the digest of every kernel's source that can be in them:
those of their own folder and of the folders of kernels that it imports, directly or through others.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import dispatcher as numba_dispatcher
from numba.core.codegen import get_host_cpu_features

__all__ = [
    "FASTMATH",
    "cache_folder",
    "inner_loop",
    "kernels_within",
    "noalias_active",
    "parallel_kernel",
    "scalar_kernel",
    "summing_loop",
]


# The default layer aborts the process when two threads call parallel kernels at once; OpenMP and TBB do not.
numba.config.THREADING_LAYER = "threadsafe"
numba.config.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]

# An idle thread of libgomp turns in a loop for milliseconds before it sleeps. On a machine that others use too, a small
# call of a kernel then takes 10 ms instead of 0.1; asleep at once, large calls are as fast as before.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

# LLVM splits AVX-512 vectors in halves for fear of slow clocks on old processors; gathers lose half their speed by it.
if not numba.config.CPU_FEATURES and not numba.config.CPU_NAME:
    _features = get_host_cpu_features()
    if "+avx512f" in _features.split(","):
        numba.config.CPU_FEATURES = f"{_features},-prefer-256-bit"

IMPORTED_KERNELS = re.compile(r"^(?:from|import) (\w+(?:\.\w+)*\.kernels)\b", re.MULTILINE)

# NaN means "unknown" here, so the flags that let the compiler assume there are none ("nnan", "ninf") stay out.
FASTMATH = frozenset({"nsz", "arcp", "contract", "afn"})

_FunctionCompiler = getattr(numba_dispatcher, "_FunctionCompiler", None)

if _FunctionCompiler is not None:

    class _NoAliasCompiler(_FunctionCompiler):  # type: ignore[misc, valid-type] # private to numba
        """numba's function compiler with the noalias flag set."""

        def _customize_flags(self, flags: Any) -> Any:
            flags.noalias = True
            return flags


@functools.cache
def kernels_within(package: str) -> tuple[str, ...]:
    """The folders of kernels, as dotted names, whose kernels may be compiled into those of a folder of kernels.

    That is the folder itself and all that its modules import, directly or through others. A kernel outside every
    folder of kernels (of a test, say) may hold any.
    """
    home = Path(__file__).resolve().parent.parent
    if not (home / Path(*package.split("."))).is_dir() or not package.endswith("kernels"):
        found = (folder.relative_to(home) for pattern in ("*/kernels", "*/*/kernels") for folder in home.glob(pattern))
        return tuple(sorted(".".join(folder.parts) for folder in found))
    known, waiting = set[str](), [package]
    while waiting:
        known.add(here := waiting.pop())
        for source in (home / Path(*here.split("."))).glob("*.py"):
            imported = IMPORTED_KERNELS.findall(source.read_text(encoding="utf-8"))
            waiting += [name for name in imported if name not in known]
    return tuple(sorted(known))


@functools.cache
def cache_folder(base: str, package: str) -> str:
    """Folder for the compiled kernels of one folder under ``base`` (beside this file when empty), named by sources."""
    home, here = Path(__file__).resolve().parent.parent, Path(__file__).parent
    sha = hashlib.sha256()
    for source in sorted(here.glob("*.py")):
        sha.update(source.read_bytes())
    for within in kernels_within(package):
        for source in sorted((home / Path(*within.split("."))).glob("*.py")):
            sha.update(source.read_bytes())
    return str((Path(base) if base else here / "__pycache__") / f"kernels-{sha.hexdigest()[:16]}")


def _compile(function: Callable[..., Any], **options: Any) -> Any:
    base = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = cache_folder(base, function.__module__.rpartition(".")[0])
    try:
        return numba.njit(cache=True, error_model="numpy", **options)(function)
    finally:
        numba.config.CACHE_DIR = base


def scalar_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that runs on one thread, and leaves the interpreter to others meanwhile."""
    return _compile(function, nogil=True)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel whose prange loops run on numba's threads."""
    return _compile(function, parallel=True)


def inner_loop(function: Callable[..., Any]) -> Any:
    """Compile an inner loop whose array arguments never overlap."""
    compiled = _compile(function, fastmath=set(FASTMATH))
    if noalias_active():
        compiled._compiler.__class__ = _NoAliasCompiler
    return compiled


def summing_loop(function: Callable[..., Any]) -> Any:
    """Compile an inner loop that sums in whatever order is fastest; rounding differs by machine, NaN stays NaN."""
    return _compile(function, fastmath={*FASTMATH, "reassoc"})


def noalias_active() -> bool:
    """Whether this numba has the hook through which arrays are marked as not overlapping."""
    return _FunctionCompiler is not None and hasattr(_FunctionCompiler, "_customize_flags")
