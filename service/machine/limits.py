"""What this process may take of its machine: memory and processors, as its control group and its affinity say.

Control groups of version 2 (``memory.max``, ``cpu.max``) and 1 (``memory.limit_in_bytes``, ``cpu.cfs_quota_us``) are
read as cgroups(7), the kernel's admin-guide/cgroup-v2 and cgroup-v1/memory describe them: a limit of any group above
holds as well, so the least counts.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Machine", "give_memory_back", "physical_bytes", "resident_bytes", "this_machine"]


@dataclass(frozen=True, slots=True)
class Machine:
    """Memory and processors for all processes of a service together.

    memory_bytes: the least of the physical memory and every limit. limited: a control group sets it, the machine
    otherwise. cores: whole processors, at least one. killed_together: out of memory the kernel ends every process of
    the control group, the one that answers HTTP too (``memory.oom.group``).
    """

    memory_bytes: int
    limited: bool
    cores: int
    killed_together: bool = False


def physical_bytes() -> int:
    """The machine's memory."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def resident_bytes(process: str = "self") -> int:
    """What a process has in memory, libraries too; 0 for one that has just ended, and where there is no proc."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0


def give_memory_back() -> None:
    """Hand memory that was freed back to the system, which glibc keeps for later otherwise; nothing elsewhere."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def this_machine(root: Path = Path("/")) -> Machine:
    """What the process may take now. root: where ``proc`` and ``sys`` are found."""
    memory_bytes, limited, killed_together = physical_bytes(), False, False
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    for folder in _groups(root, "memory"):
        for name in ("memory.max", "memory.limit_in_bytes"):
            limit = _number(folder / name)
            if limit is not None and limit < memory_bytes:
                memory_bytes, limited = limit, True
        killed_together |= _number(folder / "memory.oom.group") == 1
    for folder in _groups(root, "cpu"):
        quota = _quota(folder)
        if quota is not None:
            cores = max(1, min(cores, int(quota)))
    return Machine(memory_bytes, limited, cores, killed_together)


def _groups(root: Path, controller: str) -> Iterator[Path]:
    """Folders of the process's groups that may limit the controller, of both versions, with all that lie above."""
    try:
        mounts = (root / "proc/self/mountinfo").read_text(encoding="utf-8")
        groups = (root / "proc/self/cgroup").read_text(encoding="utf-8")
    except OSError:  # no Linux, or no proc: the machine alone sets limits
        return
    paths = {}
    for line in groups.splitlines():
        _, controllers, path = line.split(":", 2)
        paths.update(dict.fromkeys(controllers.split(","), path))
    for line in mounts.splitlines():
        # 36 35 98:0 /root /mount/point rw,noatime master:1 - cgroup2 cgroup2 rw
        before, _, after = line.partition(" - ")
        kind, _, options = after.split(" ")[:3]
        if kind == "cgroup2":
            name = ""
        elif kind == "cgroup" and controller in options.split(","):
            name = controller
        else:
            continue
        if name in paths:
            mounted, point = before.split(" ")[3:5]
            yield from _from_group_to_top(root / point.lstrip("/"), mounted, paths[name])


def _from_group_to_top(point: Path, mounted: str, path: str) -> Iterator[Path]:
    """In a container the group is often mounted itself, so that its path from outside leads nowhere in there."""
    inside = path.removeprefix(mounted.rstrip("/")) if path.startswith(mounted) else "/"
    folder = point / inside.lstrip("/")
    if not folder.is_dir():
        folder = point
    while folder != point.parent:
        yield folder
        folder = folder.parent


def _number(path: Path) -> int | None:
    """The number in a file; None when it sets no limit ("max"), or there is no such file."""
    try:
        text = path.read_text(encoding="ascii").strip()
    except OSError:
        return None
    return int(text) if text.lstrip("-").isdigit() else None


def _quota(folder: Path) -> float | None:
    """Processors that a group may keep busy, where it says so."""
    try:
        quota, period = (folder / "cpu.max").read_text(encoding="ascii").split()
        return None if quota == "max" else int(quota) / int(period)
    except OSError:
        quota_us, period_us = _number(folder / "cpu.cfs_quota_us"), _number(folder / "cpu.cfs_period_us")
    return quota_us / period_us if quota_us is not None and quota_us > 0 and period_us else None
