"""How long a session takes to say what lies ahead and what to do about it: another speed, another path, a move."""

from __future__ import annotations

import contextlib
import time

import numpy as np

from benchmarks.detection.map_loop import SEED, Ground, drive_of, grounds
from benchmarks.report import Row, Table, duration
from detection import PositionFix
from detection.simulation import SimulatedDrive
from planning.errors import PlacementError
from planning.watching import Drive, advise, advise_move, advise_path
from visibility import Anchor

__all__ = ["advice_speed"]

NEEDED = 5  # anchors: of eight around a drive, seldom so many are in sight all along


def _advised_s(ground: Ground, driven: SimulatedDrive) -> tuple[float, bool, bool]:
    """(CPU seconds of the whole advice, whether there was a dark stretch, whether a way round it) at the beginning."""
    speed = ground.speed_m_per_s
    drive = Drive(driven.places_m[[0, -1], :2], speed, 2.0 * speed, NEEDED, horizon_m=ground.length_m)
    place = PositionFix(driven.places_m[0], 0.25 * np.eye(3), checked=True)
    anchors = [Anchor(one.id, one.east_m, one.north_m, one.altitude_m) for one in driven.anchors]
    begin_s = time.process_time()
    ahead = advise(ground.grid, drive, place, driven.anchors, errors=ground.errors)
    way = None
    if ahead.stretches:
        way = advise_path(ground.grid, drive, ahead.stretches[0], anchors, at_m=ahead.at_m).path_m
        with contextlib.suppress(PlacementError):  # the drone may stand nowhere else; that took its time too
            advise_move(ground.grid, drive, ahead.stretches[0], anchors, movable=[anchors[0].id])
    return time.process_time() - begin_s, bool(ahead.stretches), way is not None


def advice_speed(drives: int = 12) -> Table:
    """CPU seconds of a whole advice with a speed, a way round and a move, by ground."""
    rows = []
    for ground in grounds():
        generator = np.random.default_rng(SEED)
        driven = [drive_of(ground, generator) for _ in range(drives + 1)]
        # the first loads the kernels
        told = [_advised_s(ground, one) for one in driven][1:]
        dark = [one for one in told if one[1]]
        if not dark:
            rows.append(Row((ground.name, f"0 of {drives}", "0", "", "")))
            continue
        times_s = [one[0] for one in dark]
        cells = (
            ground.name, f"{len(dark)} of {drives}", str(sum(one[2] for one in dark)),
            duration(float(np.median(times_s))), duration(max(times_s)),
        )  # fmt: skip
        rows.append(Row(cells, "<= 1 s", max(times_s) <= 1.0))
    columns = ("ground", "with a dark stretch", "a way round", "median", "longest")
    note = f"At the beginning of drives as above, {NEEDED} anchors wanted: stretches, bubbles, speeds, path, one move."
    return Table("CPU time of a whole advice, 8 anchors", columns, rows, note)
