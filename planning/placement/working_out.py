"""The table of sight worked out parcel by parcel: on this machine, or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import ClusterError
from terrain import ElevationGrid

from .cluster import Cluster, bits_from_cluster
from .sight import Bits, Parcel, SightOptions, SightTable, enter, parcel_bits, parcels
from .targets import Targets

__all__ = ["WorkedOut", "sight_table"]


@dataclass(frozen=True, slots=True, eq=False)
class WorkedOut:
    """A table of sight. done: (n,) bool, whether each anchor was worked out before the work was stopped."""

    table: SightTable
    done: npt.NDArray[np.bool_]
    warnings: tuple[str, ...] = ()


def sight_table(
    grid: ElevationGrid,
    targets: Targets,
    position_m: npt.NDArray[np.float64],
    options: SightOptions,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
    cluster: Cluster | None = None,
) -> WorkedOut:
    """The sight of anchors (n, 3) and targets. Raises AnchorError, ClusterError."""
    table = SightTable(np.zeros((len(position_m), max((len(targets) + 63) // 64, 1)), np.uint64), len(targets))
    done = np.zeros(len(position_m), np.bool_)
    makes = parcels(grid, targets, position_m, options)
    left = set(range(len(makes)))
    warnings: tuple[str, ...] = ()

    def take_in(work: Iterator[tuple[int, Parcel, Bits]]) -> None:
        for number, parcel, bits in work:
            enter(table, parcel, bits)
            done[parcel.rows] = True
            left.discard(number)
            if progress is not None:
                progress(float(done.mean()))

    def stopped() -> bool:
        # something has to come of it, however early
        return stop is not None and bool(done.any()) and stop()

    if cluster is not None and makes:
        try:
            take_in(bits_from_cluster(cluster, makes, stopped))
        except ClusterError as error:
            if not cluster.or_local:
                raise
            warnings = (f"{error} {len(left):,} of {len(makes):,} parcels were done on this machine instead.",)
        if stopped():
            return WorkedOut(table, done, warnings)
    take_in(_here(makes, sorted(left), stopped))
    return WorkedOut(table, done, warnings)


def _here(
    makes: list[Callable[[], Parcel]], numbers: list[int], stopped: Callable[[], bool]
) -> Iterator[tuple[int, Parcel, Bits]]:
    for number in numbers:
        if stopped():
            return
        parcel = makes[number]()
        yield number, parcel, parcel_bits(parcel)
