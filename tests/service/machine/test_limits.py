"""Limits of control groups are found where the kernel's documents say that they are; the least of all holds."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from service.machine.limits import physical_bytes, this_machine

GIB = 2**30
V2_HOST = ("0::/system.slice/sightline.service\n", "31 23 0:28 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n")
# a container with a name space of its own sees its group as the root of everything
V2_CONTAINER = ("0::/\n", "31 23 0:28 / /sys/fs/cgroup ro,nosuid - cgroup2 cgroup rw,nsdelegate\n")
# one without sees the path from outside, and its own group mounted
V1_CONTAINER = (
    "5:memory:/docker/abc\n4:cpu,cpuacct:/docker/abc\n0::/\n",
    "35 31 0:32 /docker/abc /sys/fs/cgroup/memory ro - cgroup cgroup rw,memory\n"
    "32 31 0:29 /docker/abc /sys/fs/cgroup/cpu,cpuacct ro - cgroup cgroup rw,cpu,cpuacct\n",
)
CORES = len(os.sched_getaffinity(0))


def made(root: Path, told: tuple[str, str], files: dict[str, str]) -> Path:
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/self/cgroup").write_text(told[0])
    (root / "proc/self/mountinfo").write_text("22 1 8:1 / / rw shared:1 - ext4 /dev/root rw\n" + told[1])
    for name, text in files.items():
        path = root / "sys/fs/cgroup" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{text}\n")
    return root


def test_a_service_of_systemd_has_the_limit_of_its_group(tmp_path: Path) -> None:
    group = "system.slice/sightline.service"
    files = {f"{group}/memory.max": str(GIB), f"{group}/cpu.max": "100000 100000", "system.slice/memory.max": "max"}
    found = this_machine(made(tmp_path, V2_HOST, files))
    assert (found.memory_bytes, found.limited, found.cores) == (GIB, True, 1)


def test_a_limit_of_a_group_above_holds_too(tmp_path: Path) -> None:
    files = {"system.slice/sightline.service/memory.max": str(GIB), "system.slice/memory.max": str(GIB // 2)}
    assert this_machine(made(tmp_path, V2_HOST, files)).memory_bytes == GIB // 2


def test_a_container_of_version_2_sees_its_group_at_the_top(tmp_path: Path) -> None:
    files = {"memory.max": str(1400 * 2**20), "cpu.max": "50000 100000", "memory.oom.group": "1"}
    found = this_machine(made(tmp_path, V2_CONTAINER, files))
    assert (found.memory_bytes, found.cores, found.killed_together) == (1400 * 2**20, 1, True)


def test_a_container_of_version_1_has_its_group_mounted(tmp_path: Path) -> None:
    files = {
        "memory/memory.limit_in_bytes": str(GIB),
        "cpu,cpuacct/cpu.cfs_quota_us": "150000",
        "cpu,cpuacct/cpu.cfs_period_us": "100000",
    }
    found = this_machine(made(tmp_path, V1_CONTAINER, files))
    assert (found.memory_bytes, found.limited, found.cores) == (GIB, True, 1)


@pytest.mark.parametrize("memory", ["max", "9223372036854771712"])
def test_no_limit_leaves_the_machine(memory: str, tmp_path: Path) -> None:
    name = "memory.max" if memory == "max" else "memory/memory.limit_in_bytes"
    told = V2_CONTAINER if memory == "max" else V1_CONTAINER
    more = {"cpu.max": "max 100000", "cpu,cpuacct/cpu.cfs_quota_us": "-1", "cpu,cpuacct/cpu.cfs_period_us": "100000"}
    found = this_machine(made(tmp_path, told, {name: memory, **more}))
    assert (found.memory_bytes, found.limited, found.cores) == (physical_bytes(), False, CORES)


def test_more_processors_than_there_are_are_not_taken(tmp_path: Path) -> None:
    assert this_machine(made(tmp_path, V2_CONTAINER, {"cpu.max": "6400000 100000"})).cores == CORES


def test_without_proc_the_machine_alone_counts(tmp_path: Path) -> None:
    assert this_machine(tmp_path).memory_bytes == physical_bytes()
