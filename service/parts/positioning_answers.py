"""What answers about positioning have in common."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from service.parts.map_facts import MapSummary, ground_of
from service.parts.positioning import ORBIT_TEXTS, PositioningParameters
from service.parts.positioning_answers import PlacedAnchor, PlacedSatellite, placed_anchors, placed_satellites
from service.parts.ranging_sources import RangingSources
from visibility import MinimumVisibleAltitude

__all__ = ["PositioningSummary", "positioning_summary"]


class PositioningSummary(MapSummary):
    """What maps of positioning have in common."""

    kind: str = Field(description="What is measured: ranging, pseudorange or tdoa.")
    measure: str = Field(description="Which dilution of precision.")
    dop_limit: float = Field(description="From this dilution on positioning is not good enough, no unit.")
    anchors: list[PlacedAnchor]
    satellites: list[PlacedSatellite]
    unhealthy_satellites: list[str] = Field([], description="Ids of satellites that were left out as unhealthy.")


def positioning_summary(
    lines: MinimumVisibleAltitude,
    sources: RangingSources,
    parameters: PositioningParameters,
    elapsed_s: float,
    warnings: Sequence[str] = (),
) -> PositioningSummary:
    """What is told of a map from these sight lines; of what was asked, all that is not long.

    elapsed_s, warnings: of the calculation that followed them, besides their own.
    """
    grid = lines.grid
    return PositioningSummary(
        version=lines.version,
        mode=parameters.mode,
        error_statement=lines.error_statement,
        curvature=lines.curvature.sentence(),
        unknown=parameters.unknown,
        dem=ground_of(grid),
        warnings=[*grid.provenance.warnings, *lines.warnings, *warnings, *sources.warnings],
        timing={"calculation_s": lines.elapsed_s + elapsed_s},
        parameters=parameters.model_dump(
            mode="json", exclude_none=True, exclude={"satellites": set(ORBIT_TEXTS), "path": True, "tracks": True}
        ),
        kind=parameters.kind,
        measure=parameters.measure,
        dop_limit=parameters.dop_limit,
        anchors=placed_anchors(grid, lines.anchors),
        satellites=placed_satellites(lines.anchors),
        unhealthy_satellites=list(sources.unhealthy),
    )
