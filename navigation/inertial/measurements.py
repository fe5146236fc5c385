"""What corrects an inertial solution: each measurement is a scalar of one of six kinds, at its own time."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import numbers, positions
from .kernels import corrections as kernel

__all__ = [
    "Measurements",
    "coordinates",
    "ground_heights",
    "join",
    "position_fixes",
    "ranges_to_anchors",
    "rates_along",
    "standstill",
    "vehicle_speeds",
    "velocity_fixes",
]

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Measurements:
    """Scalars in order of time, (m,) each: kinds, values, variances (inf = left out), vectors (m, 3), gates in sigmas.

    offsets_m: (m, 3) on the vehicle from the antenna, where the lever arm ends, to where each is measured; of changes
    of phase where the satellite was before. source: (m,) which of the joined lists each came from, row: (m,) its row
    there.
    """

    times_s: Array
    kinds: Ints
    values: Array
    variances: Array
    vectors: Array
    offsets_m: Array
    gates: Array
    source: Ints
    row: Ints

    def __len__(self) -> int:
        return len(self.times_s)


def join(*lists: Measurements) -> Measurements:
    """All measurements in order of time; of one instant in the order given."""
    sources = [np.full(len(one), number, np.int64) for number, one in enumerate(lists)]
    times = np.concatenate([one.times_s for one in lists]) if lists else np.empty(0)
    order = np.argsort(times, kind="stable")

    def all_of(name: str) -> npt.NDArray[np.float64]:
        return np.ascontiguousarray(np.concatenate([getattr(one, name) for one in lists])[order])

    if not lists:
        return _measurements(kernel.COORDINATE, times, np.empty(0), 1.0, np.empty((0, 3)), math.inf)
    return Measurements(
        times[order],
        np.concatenate([one.kinds for one in lists])[order],
        all_of("values"),
        all_of("variances"),
        all_of("vectors"),
        all_of("offsets_m"),
        all_of("gates"),
        np.concatenate(sources)[order],
        np.concatenate([one.row for one in lists])[order],
    )


def position_fixes(
    times_s: npt.ArrayLike, positions_m: npt.ArrayLike, sigmas_m: npt.ArrayLike, *, gate_sigma: float = math.inf
) -> Measurements:
    """Places of the antenna, (n, 3) east, north, up in the frame, NaN = none; sigmas_m: of each axis."""
    return _of_axes(kernel.COORDINATE, times_s, positions_m, sigmas_m, gate_sigma)


def coordinates(
    times_s: npt.ArrayLike,
    along_m: npt.ArrayLike,
    directions: npt.ArrayLike,
    sigmas_m: npt.ArrayLike,
    *,
    gate_sigma: float = math.inf,
) -> Measurements:
    """How far the antenna lies along directions (n, 3) in the frame, (n,) from its origin, NaN = none."""
    variances = np.asarray(sigmas_m, np.float64) ** 2
    return _measurements(
        kernel.COORDINATE, times_s, along_m, variances, positions("directions", directions), gate_sigma
    )


def velocity_fixes(
    times_s: npt.ArrayLike,
    velocities_m_per_s: npt.ArrayLike,
    sigmas_m_per_s: npt.ArrayLike,
    *,
    gate_sigma: float = math.inf,
) -> Measurements:
    """Velocities of the antenna, (n, 3) east, north, up, NaN = none."""
    return _of_axes(kernel.RATE, times_s, velocities_m_per_s, sigmas_m_per_s, gate_sigma)


def rates_along(
    times_s: npt.ArrayLike,
    rates_m_per_s: npt.ArrayLike,
    directions: npt.ArrayLike,
    sigmas_m_per_s: npt.ArrayLike,
    *,
    gate_sigma: float = math.inf,
) -> Measurements:
    """How fast the antenna moves along directions (n, 3) in the frame, (n,), NaN = none."""
    variances = np.asarray(sigmas_m_per_s, np.float64) ** 2
    return _measurements(
        kernel.RATE, times_s, rates_m_per_s, variances, positions("directions", directions), gate_sigma
    )


def standstill(times_s: npt.ArrayLike, sigma_m_per_s: float = 0.01) -> Measurements:
    """Zero velocity at instants when the vehicle stands still (ZUPT)."""
    along = [_along(times_s, 0.0, sigma_m_per_s, direction, math.inf) for direction in np.eye(3)]
    return join(*along)


def vehicle_speeds(
    times_s: npt.ArrayLike,
    forward_m_per_s: npt.ArrayLike | None,
    sigma_m_per_s: float,
    *,
    sideways_sigma_m_per_s: float = 0.0,
    mounting_rad: tuple[float, float] = (0.0, 0.0),
    pivot_m: npt.ArrayLike = (0.0, 0.0, 0.0),
    rates_rad_per_s: npt.ArrayLike = (0.0, 0.0, 0.0),
    gate_sigma: float = math.inf,
) -> Measurements:
    """Speeds of an odometer, and that a vehicle goes neither sideways nor off the ground (non-holonomic constraint).

    forward_m_per_s: (n,), NaN = none; None = the constraint alone. sideways_sigma_m_per_s: of both other directions, 0
    = they are not constrained. mounting_rad: how far the direction of driving lies left of the unit's x axis, and above
    it. pivot_m: (3,) from the unit to where the speeds are those told, amid the wheels, forward, left, up; the unit
    swings about it at rates_rad_per_s, (n, 3) or (3,). Raises MeasurementError.
    """
    left, above = mounting_rad
    forward = np.array([math.cos(above) * math.cos(left), math.cos(above) * math.sin(left), math.sin(above)])
    side = np.array([-math.sin(left), math.cos(left), 0.0])
    swing = -np.cross(np.asarray(rates_rad_per_s, np.float64), np.asarray(pivot_m, np.float64))
    found = []
    if forward_m_per_s is not None:
        told = np.asarray(forward_m_per_s, np.float64) + swing @ forward
        found.append(_along(times_s, told, sigma_m_per_s, forward, gate_sigma))
    if sideways_sigma_m_per_s > 0.0:
        for direction in (side, np.cross(forward, side)):
            found.append(_along(times_s, swing @ direction, sideways_sigma_m_per_s, direction, gate_sigma))
    return join(*found)


def ranges_to_anchors(
    times_s: npt.ArrayLike,
    anchors_m: npt.ArrayLike,
    measured_m: npt.ArrayLike,
    sigmas_m: npt.ArrayLike,
    *,
    sight: npt.ArrayLike = 1.0,
    least_sight: float = 0.1,
    offsets_m: npt.ArrayLike = (0.0, 0.0, 0.0),
    gate_sigma: float = math.inf,
) -> Measurements:
    """Two-way ranges, each at its own time: (n,) to anchors (n, 3), NaN = none.

    offsets_m: (n, 3) or (3,) from the antenna to the radio of each, forward, left, up, where a vehicle carries several.
    sight: probability that the map gives to each being in sight there: below least_sight a range is left out, otherwise
    its variance is divided by it. Raises MeasurementError.
    """
    anchors = positions("anchors_m", anchors_m)
    shape = (len(anchors),)
    seen = numbers("sight", np.broadcast_to(sight, shape), shape)
    if not ((seen >= 0.0) & (seen <= 1.0)).all():
        raise MeasurementError("sight must be probabilities from 0 to 1.")
    sigmas = numbers("sigmas_m", np.broadcast_to(sigmas_m, shape), shape)
    variances = np.where(seen >= max(least_sight, 1e-9), sigmas**2 / np.maximum(seen, 1e-9), math.inf)
    found = _measurements(kernel.RANGE, times_s, measured_m, variances, anchors, gate_sigma)
    offsets = numbers("offsets_m", np.broadcast_to(offsets_m, anchors.shape), anchors.shape)
    if not np.isfinite(offsets).all():
        raise MeasurementError("offsets_m must be finite.")
    return replace(found, offsets_m=offsets)


def ground_heights(
    times_s: npt.ArrayLike,
    heights_m: npt.ArrayLike,
    sigma_m: npt.ArrayLike,
    *,
    slopes: npt.ArrayLike = (0.0, 0.0),
    places_m: npt.ArrayLike = (0.0, 0.0),
    gate_sigma: float = math.inf,
) -> Measurements:
    """Heights of the antenna's reference over a DEM: (n,) where it stands by the map at places_m (n, 2) east, north.

    slopes: (n, 2) rise of the ground per metre east and north there. Raises MeasurementError.
    """
    heights = np.atleast_1d(np.array(heights_m, np.float64))
    count = len(heights)
    rise = numbers("slopes", np.broadcast_to(slopes, (count, 2)), (count, 2))
    places = numbers("places_m", np.broadcast_to(places_m, (count, 2)), (count, 2))
    directions = np.column_stack([-rise, np.ones(count)])
    variances = np.asarray(sigma_m, np.float64) ** 2
    return _measurements(
        kernel.COORDINATE, times_s, heights - (rise * places).sum(axis=1), variances, directions, gate_sigma
    )


def _of_axes(
    kind: int, times_s: npt.ArrayLike, values: npt.ArrayLike, sigmas: npt.ArrayLike, gate: float
) -> Measurements:
    table = np.array(values, np.float64)
    if table.ndim != 2 or table.shape[1] != 3:
        raise MeasurementError(f"Fixes must be (n, 3) east, north, up, not shape {table.shape}.")
    spread = numbers("sigmas", np.broadcast_to(sigmas, table.shape), table.shape)
    axes = [
        _measurements(kind, times_s, table[:, i], spread[:, i] ** 2, np.tile(np.eye(3)[i], (len(table), 1)), gate)
        for i in range(3)
    ]
    return join(*axes)


def _along(times_s: npt.ArrayLike, speeds: npt.ArrayLike, sigma: float, direction: Array, gate: float) -> Measurements:
    times = np.atleast_1d(np.asarray(times_s, np.float64))
    values = np.broadcast_to(np.asarray(speeds, np.float64), times.shape)
    return _measurements(kernel.ALONG, times, values, sigma**2, np.tile(direction, (len(times), 1)), gate)


def _measurements(
    kind: int, times_s: npt.ArrayLike, values: npt.ArrayLike, variances: npt.ArrayLike, vectors: Array, gate: float
) -> Measurements:
    count = len(vectors)
    times, value = numbers("times_s", times_s, (count,)), numbers("values", values, (count,))
    variance = numbers("variances", np.broadcast_to(variances, (count,)), (count,))
    if not np.isfinite(times).all() or np.isinf(value).any() or not np.isfinite(vectors).all():
        raise MeasurementError("Measurements must have finite times and vectors, and values that are finite or NaN.")
    if not (variance > 0.0).all() or not gate > 0.0:
        raise MeasurementError("Sigmas and gates must be above zero.")
    return Measurements(
        times,
        np.full(count, kind, np.int64),
        value,
        variance,
        np.ascontiguousarray(vectors),
        np.zeros((count, 3)),
        np.full(count, float(gate)),
        np.zeros(count, np.int64),
        np.arange(count, dtype=np.int64),
    )
