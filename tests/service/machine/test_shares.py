"""What all processes may take together fits into the machine, and a short one starts fewer of them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from service.http.health import memory_of, sentence_of_memory
from service.machine.limits import Machine
from service.machine.shares import LEAST_BYTES, Processes, processes_for
from service.settings import Settings

MIB = 2**20


@pytest.mark.parametrize("limit_mib", [1100, 1430, 2048, 4096, 16_384, 65_536, 1_048_576])
@pytest.mark.parametrize("cores", [1, 2, 8, 64])
@pytest.mark.parametrize("limited", [True, False])
def test_all_processes_at_their_heaviest_tasks_fit(limit_mib: int, cores: int, limited: bool) -> None:
    machine = Machine(limit_mib * MIB * (1 if limited else 2), limited, cores)
    some = processes_for(machine)
    most = some.most_bytes(some.calculation_bytes(machine))
    assert most <= machine.memory_bytes * (1.0 if limited else 0.75)
    assert 1 <= some.workers <= cores


def test_a_container_of_a_gigabyte_and_a_half_gets_few_processes_that_can_do_something() -> None:
    machine = Machine(1430 * MIB, limited=True, cores=1)
    assert processes_for(machine) == Processes(1, 1, 0)
    assert processes_for(machine).calculation_bytes(machine) >= 256 * MIB


def test_too_little_memory_is_told_with_what_to_lower() -> None:
    settings = Settings(workers=4, file_workers=2, spare_workers=1, max_worker_memory_bytes=LEAST_BYTES)
    fits, told = sentence_of_memory(settings, Machine(1024 * MIB, limited=True, cores=1))
    assert not fits
    assert "1,024 MiB of memory (control group), 1 core" in told
    assert "lower SIGHTLINE_WORKERS" in told
    assert not memory_of(settings, Machine(1024 * MIB, limited=True, cores=1)).fits


def test_a_kernel_that_ends_all_processes_together_is_told() -> None:
    settings = Settings(workers=1, file_workers=1, spare_workers=0, max_worker_memory_bytes=LEAST_BYTES)
    fits, told = sentence_of_memory(settings, Machine(4096 * MIB, limited=True, cores=1, killed_together=True))
    assert not fits
    assert "memory.oom.group" in told
    assert sentence_of_memory(settings, Machine(4096 * MIB, limited=True, cores=1))[0]


PAGE = Path(__file__).resolve().parents[3] / "docs" / "operating.md"
ROW = re.compile(r"^\| ([\d.]+) (GB|GiB), (\d+) \| (\d+) \| ([\d.]+) (MiB|GiB) \| (\d), (\d) \|$", re.MULTILINE)
UNITS = {"MiB": MIB, "GiB": 1024 * MIB, "GB": 10**9}


def test_the_page_for_operators_tells_how_much_is_shared_out() -> None:
    rows = ROW.findall(PAGE.read_text(encoding="utf-8"))
    assert len(rows) == 6
    for size, unit, cores, workers, each, each_unit, files, spares in rows:
        machine = Machine(round(float(size) * UNITS[unit]), limited=True, cores=int(cores))
        processes = processes_for(machine)
        assert processes == Processes(int(workers), int(files), int(spares))
        told_bytes = float(each) * UNITS[each_unit]
        assert processes.calculation_bytes(machine) == pytest.approx(told_bytes, rel=0.04)
