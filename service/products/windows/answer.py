"""Maps over rasters larger than memory, as the service tells about them."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, Field

from service.parts.radios import Sight
from service.products.visibility.calculate import ReceiverHeight
from terrain import ElevationGrid, height_reference_of
from visibility.sight.in_reach import name_of

from .ground import Prepared
from .parcels import ParcelFacts
from .request import WindowMapParameters

__all__ = ["AnchorInReach", "LargeGround", "WindowMap", "WindowMapSummary", "summary_of"]


class LargeGround(BaseModel):
    """Which raster this is; its heights are never all in memory."""

    name: str = Field(description="File name.")
    sha256: str | None = Field(
        description="Digest of heights and geometry; null of a raster that is read by windows, which nobody reads all."
    )
    rows: int = Field(description="Rows of posts.")
    cols: int = Field(description="Columns of posts.")
    cell_east_m: float = Field(description="From post to post eastward, metres.")
    cell_north_m: float = Field(description="From post to post northward, metres.")
    crs: str | None = Field(description="Metric CRS; null for a local frame.")
    vertical_datum: str | None = Field(description="What heights count from, where that is known.")
    heights_count_from: str = Field(description="What that is: sea level, ellipsoid or unknown.")


class AnchorInReach(BaseModel):
    """One anchor, and what of the ground in its reach sees it."""

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    max_range_m: float = Field(description="Longest slant range, metres.")
    posts_in_reach: int = Field(description="Posts no further from it on the map than its range.")
    visible_posts: int = Field(description="Posts of those from which it is in sight, within its antenna's limits.")
    hidden_posts: int = Field(description="Posts of those from which it is hidden.")
    unknown_posts: int = Field(description="Posts of those where unknown ground leaves it open.")


class WindowMapSummary(BaseModel):
    """What a map by windows says in numbers, and how far to trust it."""

    version: str = Field(description="Of Sightline.")
    mode: str = Field(description="fast or exact.")
    error_statement: str = Field(description="What the map may be off by, for the anchor where that is most.")
    curvature: str = Field(description="How the ground curved.")
    unknown: str = Field(description="What a line over unknown ground is.")
    receiver: ReceiverHeight
    sight: Sight = "visible"
    dem: LargeGround
    anchors: list[AnchorInReach]
    posts_in_reach: int = Field(description="Posts in reach of anchors, once for each anchor.")
    read_by: str = Field(description="Who read the ground: this process, or workers of a Dask scheduler.")
    warnings: list[str] = Field(description="What to know about ground, anchors and altitudes.")
    timing: dict[str, float] = Field(description="Seconds of wall clock: calculation_s, files_s.")


@dataclass(frozen=True, eq=False)
class WindowMap:
    """A finished map: its rasters lie in a folder of its own, which goes when nobody needs this any more."""

    grid: ElevationGrid
    parameters: WindowMapParameters
    answer: WindowMapSummary
    folder: Path

    def __post_init__(self) -> None:
        weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)


def summary_of(request: Prepared, facts: Mapping[str, ParcelFacts], read_by: str) -> WindowMapSummary:
    """What a map says, from what is told of the parcel of each anchor that has one; not yet how long it took."""
    dem, parameters, anchors = request.dem, request.parameters, request.anchors
    worst = max(facts.values(), key=lambda one: 0.0 if one.errors is None else one.errors.misclassified)
    beside = [anchor.id for anchor in anchors if anchor.id not in facts]
    warnings = [*request.told, *dict.fromkeys(warning for one in facts.values() for warning in one.warnings)]
    what = "the DEM" if request.shape is None else "the area"
    warnings += [f"No post of {what} lies in the reach of {', '.join(beside)}."] if beside else []
    rows = []
    for anchor in anchors:
        fact = facts.get(anchor.id)
        seen = (0, 0, 0) if fact is None else (fact.visible_posts, fact.hidden_posts, fact.unknown_posts)
        rows.append(
            AnchorInReach(
                id=anchor.id,
                east_m=anchor.east_m,
                north_m=anchor.north_m,
                altitude_m=anchor.altitude_m,
                max_range_m=anchor.limits.max_range_m,
                posts_in_reach=sum(seen),
                visible_posts=seen[0],
                hidden_posts=seen[1],
                unknown_posts=seen[2],
            )
        )
    return WindowMapSummary(
        version=worst.version,
        mode=parameters.mode,
        error_statement=worst.error_statement,
        curvature=worst.curvature,
        unknown=parameters.unknown,
        receiver=ReceiverHeight(
            above_ground_m=parameters.receiver_above_ground_m, altitude_m=parameters.receiver_altitude_m
        ),
        sight=parameters.sight,
        dem=LargeGround(
            name=name_of(dem),
            sha256=dem.digest if isinstance(dem, ElevationGrid) else None,
            rows=dem.rows,
            cols=dem.cols,
            cell_east_m=dem.cell_east_m,
            cell_north_m=dem.cell_north_m,
            crs=None if dem.crs is None else dem.crs.to_string(),
            vertical_datum=dem.vertical_datum,
            heights_count_from=height_reference_of(request.middle).value,
        ),
        anchors=rows,
        posts_in_reach=sum(row.posts_in_reach for row in rows),
        read_by=read_by,
        warnings=warnings,
        timing={},
    )
