"""What is ranged to: the anchors and satellites of a request in the grid's frame."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from terrain import ElevationGrid, height_at
from visibility import (
    Anchor,
    DistantAnchor,
    FlightLimit,
    MinimumVisibleAltitude,
    VisibilityInputError,
    check_anchors,
    least_anchors,
    min_visible_altitude,
)
from visibility.columns_of_air import sources_of_anchors
from visibility.flight_limits import check_geometry
from visibility.morphing_maps import check_ceiling
from visibility.satellites import Place, parse_almanac, satellite_eyes

from .map_facts import Calculation, curvature_of, dem_summary
from .positions import resolve_anchor
from .schemas.positioning import DopMapParameters, MorphingMapParameters, PositioningParameters, SatellitesIn

__all__ = ["check_sources", "common_summary", "limit_of", "ranging_sources", "sight_lines", "source_summary"]

Source = Anchor | DistantAnchor


def ranging_sources(grid: ElevationGrid, parameters: PositioningParameters) -> tuple[tuple[Source, ...], list[str]]:
    """The anchors, then the satellites in view, and sentences about those left out.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    anchors: list[Source] = [resolve_anchor(grid, anchor) for anchor in parameters.anchors]
    if parameters.satellites is None:
        return tuple(anchors), []
    satellites, warnings = _satellites(grid, parameters.satellites)
    return (*anchors, *satellites), warnings


def limit_of(parameters: PositioningParameters) -> FlightLimit:
    """The limit asked for, as the libraries take it."""
    return FlightLimit(parameters.dop_limit, parameters.measure, parameters.kind, parameters.min_anchors)


def check_sources(grid: ElevationGrid, sources: tuple[Source, ...], parameters: PositioningParameters) -> None:
    """Refuse what no map can be made from: anchors that cannot be used, too few of them, all on one line, no air.

    Raises AnchorError, VisibilityInputError.
    """
    check_anchors(grid, sources)
    if isinstance(parameters, DopMapParameters) and parameters.on_surface:
        # a rover bound to the ground is fixed by anchors on one line too
        needed = max(least_anchors(parameters.kind, on_surface=True), parameters.min_anchors or 0)
        if len(sources) < needed:
            raise VisibilityInputError(
                f"A map of {parameters.measure} along the surface from {parameters.kind} needs at least {needed} "
                f"anchors; {len(sources)} {'is' if len(sources) == 1 else 'are'} given."
            )
        return
    check_geometry(limit_of(parameters), sources_of_anchors(sources))
    if isinstance(parameters, MorphingMapParameters):
        check_ceiling(grid, *parameters.ceiling())


def sight_lines(
    grid: ElevationGrid,
    parameters: PositioningParameters,
    progress: Callable[[float], None] | None,
    share: float,
) -> tuple[MinimumVisibleAltitude, list[str]]:
    """Minimum visible altitudes of all that is ranged to, and sentences about what is not; ``share`` of the progress.

    Raises what ranging_sources and check_sources raise.
    """
    sources, warnings = ranging_sources(grid, parameters)
    check_sources(grid, sources, parameters)
    lines = min_visible_altitude(
        grid,
        sources,
        parameters.mode,
        curvature_of(parameters),
        unknown=parameters.unknown,
        progress=None if progress is None else lambda done: progress(share * done),
    )
    return lines, warnings


def source_summary(grid: ElevationGrid, sources: tuple[Source, ...]) -> dict[str, list[dict[str, Any]]]:
    """Where anchors and satellites are, ready for JSON."""
    anchors, satellites = [], []
    for source in sources:
        if isinstance(source, DistantAnchor):
            satellites.append(
                {
                    "id": source.id,
                    "grid_azimuth_deg": math.degrees(source.azimuth_rad),
                    "elevation_deg": math.degrees(source.elevation_rad),
                    "range_m": source.range_m,
                }
            )
            continue
        ground_m = float(height_at(grid, source.east_m, source.north_m))
        anchors.append(
            {
                "id": source.id,
                "east_m": source.east_m,
                "north_m": source.north_m,
                "altitude_m": source.altitude_m,
                "above_ground_m": None if math.isnan(ground_m) else source.altitude_m - ground_m,
            }
        )
    return {"anchors": anchors, "satellites": satellites}


def common_summary(
    grid: ElevationGrid, sources: tuple[Source, ...], parameters: PositioningParameters, calculation: Calculation
) -> dict[str, Any]:
    """What maps of positioning have in common, ready for JSON; of what was asked, all but the almanac's long text."""
    return {
        "version": calculation.version,
        "mode": parameters.mode,
        "error_statement": calculation.error_statement,
        "curvature": calculation.curvature,
        "unknown": parameters.unknown,
        "kind": parameters.kind,
        "measure": parameters.measure,
        "dop_limit": parameters.dop_limit,
        "dem": dem_summary(grid),
        **source_summary(grid, sources),
        "warnings": list(calculation.warnings),
        "timing": {"calculation_s": calculation.elapsed_s},
        "parameters": parameters.model_dump(mode="json", exclude_none=True, exclude={"satellites": {"almanac"}}),
    }


def _satellites(grid: ElevationGrid, asked: SatellitesIn) -> tuple[tuple[DistantAnchor, ...], list[str]]:
    almanac = parse_almanac(asked.almanac, "the almanac", asked.reference_date)
    place = None if asked.lon_deg is None or asked.lat_deg is None else Place(asked.lon_deg, asked.lat_deg)
    eyes = satellite_eyes(grid, almanac, asked.time, math.radians(asked.cone_deg), place=place)
    seen = eyes.distant_anchors(ranging_sigma_m=asked.ranging_sigma_m)
    unhealthy = eyes.view.unhealthy_ids
    return seen, [f"Satellites left out as unhealthy: {', '.join(unhealthy)}."] if unhealthy else []
