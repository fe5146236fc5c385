"""Which machine and which libraries a table was measured with."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path

import numba
import psutil

__all__ = ["description", "not_quiet"]

ROOT = Path(__file__).parents[1]


def description() -> dict[str, str]:
    """What a reader needs to judge the numbers, as label: value."""
    libraries = ("numpy", "numba", "rasterio", "trimesh", "embreex", "fastapi", "uvicorn")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "CPU": f"{_cpu_name()}, {_vector_extensions()}",
        "cores": f"{cores}, of which numba uses {numba.get_num_threads()}",
        "memory": f"{psutil.virtual_memory().total / 2**30:.0f} GiB",
        "system": f"{platform.system()} {platform.release()} {platform.machine()}, Python {platform.python_version()}",
        "libraries": ", ".join(f"{name} {importlib.metadata.version(name)}" for name in libraries),
        "Sightline": f"{importlib.metadata.version('sightline')}, commit {_commit()}",
        "load before": f"{os.getloadavg()[0]:.2f} (one-minute average; numbers count on a quiet machine only)",
    }


def not_quiet() -> str:
    """A sentence for a table's note where the machine has other work, with a space before it; else nothing."""
    load = os.getloadavg()[0]
    return f" The machine was not quiet (load before {load:.1f}): ratios count, times little." if load > 1.0 else ""


def _cpu_name() -> str:
    for label, value in _cpu_fields():
        if label == "model name":
            return value
    return platform.processor() or platform.machine()


def _vector_extensions() -> str:
    flags = next((value.split() for label, value in _cpu_fields() if label == "flags"), [])
    return "AVX-512" if "avx512f" in flags else "AVX2" if "avx2" in flags else "no AVX2"


def _cpu_fields() -> list[tuple[str, str]]:
    path = Path("/proc/cpuinfo")
    if not path.is_file():
        return []
    pairs = (line.partition(":") for line in path.read_text(encoding="utf-8").splitlines())
    return [(label.strip(), value.strip()) for label, _, value in pairs]


def _commit() -> str:
    command = ["git", "rev-parse", "--short", "HEAD"]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return answer.stdout.strip() or "unknown"
