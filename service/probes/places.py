"""Places probed: ground, slope, who is in sight by how much, dilution and error, in one go for all of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from service.parts.anchors import AnchorIn
from service.parts.cover import notes_on_cover
from service.parts.doubts import DoubtParameters, doubted_anchors
from service.parts.map_area import refuse_outside
from service.parts.map_facts import curvature_of
from service.parts.shapes_in_grid import places_in_grid, resolve_anchor
from service.parts.unused import notes_on_satellite_radios
from service.products.lines_of_sight.calculate import BlockingPoint
from terrain import ElevationGrid, height_at, to_lon_lat
from visibility import HIDDEN, UNKNOWN, VISIBLE, Anchor, Curvature, dop, lines_of_sight
from visibility.dilution import Dop, DopReason, PositionError, position_error, rover_normals
from visibility.sight import LinesOfSight, check_anchors, doubted, points_within_reach

from .request import AnchorSeen, DilutionProbed, PlaceProbed, ProbeIn, ProbeOut
from .signals import anchor_signals, signal_told

__all__ = ["number", "probe"]

Floats = npt.NDArray[np.float64]
DEFAULT_ABOVE_GROUND_M = 1.5
# less steep is level: which way it falls would be rounding
LEVEL = 1e-6
WORDS = {int(VISIBLE): "visible", int(HIDDEN): "hidden", int(UNKNOWN): "unknown"}
REASONS = {reason.value: reason.name.lower() for reason in DopReason}


def probe(grid: ElevationGrid, asked: ProbeIn) -> ProbeOut:
    """Answer about every place. Raises AreaError, AnchorError, FrameError, VisibilityInputError."""
    places_m = places_in_grid(grid, asked.points)
    refuse_outside(grid, asked.area, places_m, "points[{}]")
    anchors, warnings = _resolved(grid, AnchorsIn(anchors=asked.anchors, doubts=asked.doubts).model_dump_json())
    curvature = curvature_of(asked) or Curvature.of(grid)
    ground_m, normals = np.atleast_1d(height_at(grid, places_m[:, 0], places_m[:, 1])), _normals(grid, places_m)
    receivers_m = np.column_stack([places_m, _altitudes(asked, ground_m)])
    stands = np.isfinite(receivers_m[:, 2])
    heard = anchor_signals(grid, anchors, receivers_m[stands], curvature, asked.unknown)
    seen = _seen(grid, anchors, receivers_m[stands], curvature, asked)
    if asked.usable:
        sure = [~doubted(anchor.doubts, receivers_m[stands]) for anchor in anchors]
        enough = [(one.margin_db >= 0.0) & told for one, told in zip(heard, sure, strict=True) if one is not None]
        seen = (seen[0], np.stack(enough, axis=1) & seen[2] if enough else seen[1], seen[2])
    fixes = _fixes(anchors, receivers_m[stands], seen[1], normals[stands], asked)
    at = np.cumsum(stands) - 1
    degrees = _degrees(grid, places_m)
    points = []
    for number_, (east_m, north_m) in enumerate(places_m.tolist()):
        here = int(at[number_]) if stands[number_] else None
        slope_deg, downhill_deg = _slope(normals[number_])
        points.append(
            PlaceProbed.model_construct(
                east_m=east_m,
                north_m=north_m,
                lon_deg=degrees[number_][0],
                lat_deg=degrees[number_][1],
                ground_m=number(ground_m[number_]),
                slope_deg=slope_deg,
                downhill_deg=downhill_deg,
                receiver_altitude_m=number(receivers_m[number_, 2]),
                anchors=[
                    _anchor(seen, anchor, here, k).model_copy(
                        update={"signal": None if here is None else signal_told(heard[k], here)}
                    )
                    for k, anchor in enumerate(anchors)
                ],
                visible_anchors=0 if here is None else int(np.count_nonzero(seen[1][here])),
                dilution=_dilution(fixes, here) if anchors else None,
                position_sigma_m=_sigma(fixes, here, "position_sigma_m"),
                horizontal_sigma_m=_sigma(fixes, here, "horizontal_sigma_m"),
            )
        )
    of_signals = dict.fromkeys(note for one in heard if one is not None for note in one.warnings)
    told = [*notes_on_cover(grid), *warnings, *of_signals, *notes_on_satellite_radios(asked.anchors)]
    return ProbeOut.model_construct(points=points, curvature=curvature.sentence(), warnings=told)


def number(value: float | np.floating) -> float | None:
    """Ready for JSON, which has no NaN and no infinity."""
    return float(value) if math.isfinite(value) else None


class AnchorsIn(DoubtParameters):
    """The anchors of a probe alone, with doubts about them."""

    anchors: list[AnchorIn]


@lru_cache(maxsize=8)
def _resolved(grid: ElevationGrid, text: str) -> tuple[tuple[Anchor, ...], tuple[str, ...]]:
    """(anchors in the grid's frame, warnings): a pointer over a map asks of the same ones again and again."""
    asked = AnchorsIn.model_validate_json(text)
    anchors, passed_over = doubted_anchors(grid, [resolve_anchor(grid, one) for one in asked.anchors], asked.doubts)
    return anchors, (*passed_over, *(check_anchors(grid, anchors) if anchors else ()))


def _altitudes(asked: ProbeIn, ground_m: Floats) -> Floats:
    if asked.receiver_altitude_m is not None:
        return np.full_like(ground_m, asked.receiver_altitude_m)
    above_m = asked.receiver_above_ground_m
    return ground_m + (DEFAULT_ABOVE_GROUND_M if above_m is None else above_m)


def _normals(grid: ElevationGrid, places_m: Floats) -> Floats:
    return rover_normals(grid, places_m[:, 0], places_m[:, 1])


def _seen(
    grid: ElevationGrid, anchors: Sequence[Anchor], receivers_m: Floats, curvature: Curvature, asked: ProbeIn
) -> tuple[LinesOfSight | None, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """(lines from each receiver to each anchor in turn, (n, k) whether it is in sight, (n, k) whether in reach)."""
    n, k = len(receivers_m), len(anchors)
    reached = np.ones((n, k), np.bool_)
    if n * k == 0:
        return None, np.zeros((n, k), np.bool_), reached
    places_m = np.array([(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors])
    lines = lines_of_sight(
        grid,
        np.tile(places_m, (n, 1)),
        np.repeat(receivers_m, k, axis=0),
        curvature=curvature,
        unknown=asked.unknown,
        dem_sigma_m=asked.dem_sigma_m,
    )
    verdicts = lines.verdict.reshape(n, k)
    for column, anchor in enumerate(anchors):
        reached[:, column] = points_within_reach(anchor, receivers_m, curvature)
        verdicts[(verdicts[:, column] == VISIBLE) & doubted(anchor.doubts, receivers_m), column] = UNKNOWN
    return lines, (verdicts == VISIBLE) & reached, reached


def _fixes(
    anchors: Sequence[Anchor], receivers_m: Floats, seen: npt.NDArray[np.bool_], normals: Floats, asked: ProbeIn
) -> tuple[Dop, PositionError] | None:
    if not anchors or not len(receivers_m):
        return None
    places_m = [(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors]
    along = normals if asked.on_surface else None
    if along is not None:  # over a triangle with an unknown post the ground has no direction; it is taken as level
        along = np.where(np.isfinite(along), along, (0.0, 0.0, 1.0))
    dilutions = dop(places_m, receivers_m, asked.kind, visible=seen, surface_normal=along)
    errors = position_error(
        places_m,
        receivers_m,
        [anchor.ranging_sigma_m for anchor in anchors],
        asked.kind,
        pose_covariance_m2=np.array([_pose_covariance_m2(anchor) for anchor in anchors]),
        visible=seen,
        surface_normal=along,
    )
    return dilutions, errors


def _pose_covariance_m2(anchor: Anchor) -> Floats:
    if anchor.pose_covariance_m2 is not None:
        return np.array(anchor.pose_covariance_m2)
    return np.eye(3) * anchor.pose_sigma_m**2


def _anchor(
    seen: tuple[LinesOfSight | None, npt.NDArray[np.bool_], npt.NDArray[np.bool_]],
    anchor: Anchor,
    here: int | None,
    column: int,
) -> AnchorSeen:
    lines, _, reached = seen
    if here is None or lines is None:
        return AnchorSeen.model_construct(
            id=anchor.id, verdict="unknown", clearance_m=None, distance_m=None, blocking_point=None
        )
    line = here * reached.shape[1] + column
    hidden = int(lines.verdict[line]) == HIDDEN and bool(np.isfinite(lines.blocking_point_m[line]).all())
    east_m, north_m, altitude_m = lines.blocking_point_m[line].tolist()
    return AnchorSeen.model_construct(
        id=anchor.id,
        verdict=WORDS[int(lines.verdict[line])] if reached[here, column] else "out_of_reach",
        clearance_m=number(lines.clearance_m[line]),
        distance_m=float(lines.distance_m[line]),
        blocking_point=BlockingPoint.model_construct(east_m=east_m, north_m=north_m, altitude_m=altitude_m)
        if hidden
        else None,
        probability_clear=None if lines.probability_clear is None else number(lines.probability_clear[line]),
    )


def _dilution(fixes: tuple[Dop, PositionError] | None, here: int | None) -> DilutionProbed:
    if fixes is None or here is None:
        return DilutionProbed.model_construct(gdop=None, pdop=None, hdop=None, vdop=None, tdop=None, reason="unknown")
    found = fixes[0]
    return DilutionProbed.model_construct(
        gdop=number(found.gdop[here]),
        pdop=number(found.pdop[here]),
        hdop=number(found.hdop[here]),
        vdop=number(found.vdop[here]),
        tdop=number(found.tdop[here]),
        reason=REASONS[int(found.reason[here])],
    )


def _sigma(fixes: tuple[Dop, PositionError] | None, here: int | None, name: str) -> float | None:
    return None if fixes is None or here is None else number(getattr(fixes[1], name)[here])


def _slope(normal: Floats) -> tuple[float | None, float | None]:
    """(how steep, which way it falls), degrees."""
    east, north, up = normal.tolist()
    if math.isnan(up):
        return None, None
    flat = math.hypot(east, north)
    slope_deg = math.degrees(math.atan2(flat, up))
    return slope_deg, math.degrees(math.atan2(east, north)) % 360.0 if flat > LEVEL else None


def _degrees(grid: ElevationGrid, places_m: Floats) -> list[tuple[float | None, float | None]]:
    if grid.crs is None:
        return [(None, None)] * len(places_m)
    lon, lat = to_lon_lat(grid, places_m[:, 0], places_m[:, 1])
    return list(zip(lon.tolist(), lat.tolist(), strict=True))
