"""How many processes a service starts, and how much memory each may take, so that all of them together fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .limits import Machine

__all__ = ["LARGEST_BYTES", "LEAST_BYTES", "Processes", "processes_for", "share_of"]

MIB = 1024 * 1024
# Measured, with libraries that all share counted once, with the process that answers HTTP (docs/operating.md).
SERVER_BYTES = 384 * MIB
WARM_BYTES = 192 * MIB
# a sampled plan has OMPL in a process of its own beside its worker
PLANNER_BYTES = 128 * MIB
# what each task may take on top of a warm process, as shares of what a calculation may
SHARES = {"calculations": 1.0, "files": 0.5, "checks": 0.5, "probes": 0.25}
# on a machine that no control group parts, others live too
OF_A_MACHINE = 0.75
LEAST_BYTES = 64 * MIB
LARGEST_BYTES = 16 * 1024 * MIB
# a calculation that may take less is not worth a process more beside it
WORTH_BYTES = 256 * MIB


def share_of(lane: Literal["calculations", "files", "checks", "probes"], calculation_bytes: int) -> int:
    """Bytes that a task of the lane may take on top of a warm process."""
    return int(SHARES[lane] * calculation_bytes)


@dataclass(frozen=True, slots=True)
class Processes:
    """How many there are: for calculations, for files and checks, and standing by."""

    workers: int
    file_workers: int
    spare_workers: int

    def base_bytes(self) -> int:
        """What all take when nobody asks anything, and one planner for each calculation."""
        warm = self.workers + self.file_workers + self.spare_workers
        return SERVER_BYTES + warm * WARM_BYTES + self.workers * PLANNER_BYTES

    def most_bytes(self, calculation_bytes: int) -> int:
        """What all take when each is at the heaviest task that it may do."""
        at_work = (
            self.workers * share_of("calculations", calculation_bytes)
            + self.file_workers * share_of("files", calculation_bytes)
            + max(self.spare_workers, 1) * share_of("probes", calculation_bytes)
        )
        return self.base_bytes() + at_work

    def calculation_bytes(self, machine: Machine) -> int:
        """What one calculation may take so that all fits, but never less than ``LEAST_BYTES``."""
        parts = self.workers + SHARES["files"] * self.file_workers + SHARES["probes"] * max(self.spare_workers, 1)
        return min(LARGEST_BYTES, max(LEAST_BYTES, int((budget_bytes(machine) - self.base_bytes()) / parts)))


def budget_bytes(machine: Machine) -> int:
    """What the service may plan with."""
    return machine.memory_bytes if machine.limited else int(OF_A_MACHINE * machine.memory_bytes)


def processes_for(machine: Machine) -> Processes:
    """One calculation per core, two processes for files and one that stands by; fewer where memory is short."""
    wanted = [
        *(Processes(workers, 2, 1) for workers in range(machine.cores, 1, -1)),
        *(Processes(1, files, spare) for files, spare in ((2, 1), (1, 1), (1, 0))),
    ]
    return next((some for some in wanted if some.calculation_bytes(machine) >= WORTH_BYTES), wanted[-1])
