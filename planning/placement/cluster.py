"""Where sight is worked out: in this process, or on a Dask cluster."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.errors import ClusterError, PlacementError
from terrain import ElevationGrid
from visibility import Anchor

from .sight import (
    Bits,
    Parcel,
    SightOptions,
    SightTable,
    enter,
    forget_doubted,
    parcel_bits,
    parcels,
    positions_of,
)
from .targets import Targets

__all__ = ["Cluster", "WorkedOut", "anchors_table", "bits_from_cluster", "results_from_cluster", "sight_table"]

TRIES = 3
LOOK_EVERY_S = 0.2
AHEAD, LEAST_AHEAD = 8, 32  # parcels under way for each thread of the workers, and at least
Make = Callable[[], Parcel]
Submit = Callable[[Any, Sequence[int]], dict[Any, int]]


@dataclass(frozen=True, slots=True)
class Cluster:
    """A Dask cluster. address: of its scheduler, such as tcp://scheduler:8786.

    or_local: work on this machine, with a warning, where the cluster cannot be reached or is lost; else ClusterError.
    timeout_s: how long to wait for the scheduler, and for a first worker. Raises PlacementError.
    """

    address: str
    or_local: bool = False
    timeout_s: float = 10.0

    def __post_init__(self) -> None:
        if not self.address.strip() or not self.timeout_s > 0.0:
            raise PlacementError("A cluster needs the address of its scheduler and timeout_s > 0.")


def bits_from_cluster(
    cluster: Cluster, makes: list[Make], stop: Callable[[], bool] | None
) -> Iterator[tuple[int, Parcel, Bits]]:
    """(number, parcel, its sight) of each parcel, as they come in; ends early when ``stop`` says so.

    Raises ClusterError when the cluster cannot be reached, or is lost again and again.
    """
    made: dict[int, Parcel] = {}
    shared: dict[Any, Any] = {}  # by client: what was sent over a connection that is lost has to be sent again

    def submit(client: Any, numbers: Sequence[int]) -> dict[Any, int]:
        made.update({number: makes[number]() for number in numbers})
        whole = next((made[number] for number in numbers if made[number].which is None), None)
        if whole is not None and client.id not in shared:
            # the ground and targets of parcels that need all of them go to every worker once
            shared[client.id] = client.scatter([(whole.grid, whole.targets)], broadcast=True, hash=False)[0]
        return {_submit(client, made[number], shared.get(client.id)): number for number in numbers}

    for number, bits in results_from_cluster(cluster, len(makes), submit, stop):
        yield number, made.pop(number), bits


def results_from_cluster(
    cluster: Cluster, count: int, submit: Submit, stop: Callable[[], bool] | None
) -> Iterator[tuple[int, Any]]:
    """(number, result) of each of so many parcels, as they come in; ends early when ``stop`` says so.

    submit: hands the parcels of these numbers to a Dask client; futures and their numbers. It is asked for as many as
    keep the workers busy, and for more once some are done; again, for what is left, where the cluster was lost.
    Raises ClusterError when it cannot be reached, or is lost again and again.
    """
    left = set(range(count))
    for attempt in range(TRIES):
        client = _connect(cluster)
        try:
            for number, result in _spread(client, submit, sorted(left), stop):
                left.discard(number)
                yield number, result
            return
        except (CancelledError, asyncio.CancelledError, TimeoutError, OSError, _lost()) as error:
            if attempt == TRIES - 1:
                raise ClusterError(
                    f"The cluster at {cluster.address} was lost with {len(left):,} of {count:,} parcels to do: "
                    f"{type(error).__name__}."
                ) from error
        finally:
            client.close(timeout=cluster.timeout_s)


def _connect(cluster: Cluster) -> Any:
    """A client with at least one worker. Raises ClusterError."""
    from distributed import Client

    try:
        client = Client(cluster.address, timeout=cluster.timeout_s, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        raise ClusterError(
            f"No Dask scheduler answers at {cluster.address!r} within {cluster.timeout_s:g} s; start one with "
            "`dask scheduler`, or ask for a local run."
        ) from error
    try:
        client.wait_for_workers(1, timeout=cluster.timeout_s)
    except TimeoutError as error:
        client.close()
        raise ClusterError(
            f"The Dask scheduler at {cluster.address!r} has no worker; start some with `dask worker {cluster.address}`."
        ) from error
    return client


def _lost() -> type[Exception]:
    """What distributed raises for a task whose workers died too often."""
    from distributed import KilledWorker

    lost: type[Exception] = KilledWorker
    return lost


def _spread(
    client: Any, submit: Submit, numbers: Sequence[int], stop: Callable[[], bool] | None
) -> Iterator[tuple[int, Any]]:
    """Hand out parcels while there are any, and take in what comes of them.

    Thousands handed out at once are looked through whenever one is done, which cost connections their time.
    """
    from distributed import wait

    left, futures = deque(numbers), dict[Any, int]()
    finished: set[Any] = set()
    try:
        while left or futures:
            if stop is not None and stop():
                return
            if finished:
                future = finished.pop()
                yield futures.pop(future), future.result()
                continue
            most = max(AHEAD * sum(client.nthreads().values()), LEAST_AHEAD)
            if left and len(futures) < most:
                futures.update(submit(client, [left.popleft() for _ in range(min(most - len(futures), len(left)))]))
            try:
                with client.as_current():
                    finished = set(wait(list(futures), timeout=LOOK_EVERY_S, return_when="FIRST_COMPLETED").done)
            except TimeoutError:
                continue
    finally:
        if futures and client.status == "running":  # a lost one has nothing under way, and must be told as lost
            client.cancel(list(futures))


def _submit(client: Any, parcel: Parcel, shared: Any) -> Any:
    # impure: a repeated run must not be answered from what the cluster remembers of another ground
    if parcel.which is None:
        return client.submit(_whole, shared, parcel.rows, parcel.position_m, parcel.options, pure=False)
    return client.submit(parcel_bits, parcel, pure=False)


def _whole(
    shared: tuple[ElevationGrid, Targets],
    rows: npt.NDArray[np.intp],
    position_m: npt.NDArray[np.float64],
    options: SightOptions,
) -> Bits:
    """A parcel over all of the ground, put together where it is done."""
    grid, targets = shared
    return parcel_bits(Parcel(rows, position_m, grid, targets, None, options))


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


def anchors_table(
    grid: ElevationGrid, targets: Targets, anchors: Sequence[Anchor], options: SightOptions
) -> SightTable:
    """The sight of anchors that stand and of targets: by the signal of each that has a radio. Raises AnchorError.

    Where ranges denied an anchor's sight, it is not counted on.
    """
    table = SightTable(np.zeros((len(anchors), max((len(targets) + 63) // 64, 1)), np.uint64), len(targets))
    for radio in dict.fromkeys(anchor.radio for anchor in anchors):
        rows = [number for number, anchor in enumerate(anchors) if anchor.radio == radio]
        places_m = positions_of([anchors[number] for number in rows])
        table.bits[rows] = sight_table(grid, targets, places_m, replace(options, radio=radio)).table.bits
    for number, anchor in enumerate(anchors):
        forget_doubted(table.bits[number : number + 1], anchor.doubts, targets)
    return table


def _here(
    makes: list[Callable[[], Parcel]], numbers: list[int], stopped: Callable[[], bool]
) -> Iterator[tuple[int, Parcel, Bits]]:
    for number in numbers:
        if stopped():
            return
        parcel = makes[number]()
        yield number, parcel, parcel_bits(parcel)
