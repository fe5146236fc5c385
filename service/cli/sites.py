"""``sightline sites``: how much of the ground each post would see as a site, and which see most."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    Curvature,
    DemPath,
    Output,
    Reading,
    ReceiverHeight,
    RequestFile,
    option,
    told,
)
from .output import share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.parts.geojson_reading import Fields
    from service.products.sites.calculate import SiteMapSummary

__all__ = ["sites"]


@GROUP
@dataclass(frozen=True, slots=True)
class SiteOptions:
    """How many sites, how high they and receivers are, and what shall be seen: fields of the request."""

    sites: Annotated[int | None, option("How many sites to name. (default 10)", "K", "--count")] = None
    site_above_ground_m: Annotated[
        float | None, option("Of a site's antenna above the ground, metres. (default 10)", "M", "--height")
    ] = None
    receiver_above_ground_m: ReceiverHeight = None
    max_range_m: Annotated[float | None, option("Longest range, metres.", "M", "--max-range")] = None
    min_separation_m: Annotated[
        float | None,
        option("Named sites are so far apart, metres. (default a tenth of the shorter side)", "M", "--separation"),
    ] = None
    directions: Annotated[int | None, option("Rays from each post, a multiple of 4. (default 360)", "N")] = None
    target_area: Annotated[
        Path | None, option("Only what is in this GeoJSON polygon shall be seen.", "FILE", "--targets")
    ] = None
    curvature: Annotated[Curvature, option("auto: as the DEM's CRS implies; flat: none.")] = "auto"

    def part(self) -> dict[str, object]:
        """As the request has them. Raises RequestError."""
        found = told(self)
        if self.target_area is not None:
            found["target_area"] = _one_polygon(self.target_area)
        return found


def sites(
    dem: DemPath,
    /,
    *,
    options: SiteOptions = SiteOptions(),
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Calculate how much of the ground every place would see as a site, and name those that see most.

    With an area, sites stand in it. Writes sites.json, seen.tif, seen_from.tif, sites.geojson, sites.csv (anchors for
    other commands) and map.png into --out.
    """
    from service.products.sites.request import SiteMapParameters

    from .asking.products import ask, request_of_fields

    if not reading.cover.bare:
        raise RequestError(
            "A map of sites knows bare ground only; leave out --buildings and --canopy, or ask for a visibility map."
        )
    asked: BaseModel | Path | None = request
    if asked is None:
        asked = request_of_fields({**options.part(), "area": area.part(in_degrees=False)}, SiteMapParameters)
    from service.products.sites import SITE_MAP

    ask(SITE_MAP, dem, asked, _tables, summary="sites.json", reading=reading, output=output, margin_m=margin_m)


def _one_polygon(path: Path) -> Fields:
    from .asking.path_files import polygon_fields

    polygons = polygon_fields(path)
    if len(polygons) != 1:
        raise RequestError(f"The file {path.name} holds {len(polygons)} polygons; --targets is one.")
    return polygons[0]


def _tables(answer: SiteMapSummary) -> tuple[Table, ...]:
    table = Table(
        title=escape(f"{answer.dem.name}: sites that see most of {answer.target_m2 / 1e6:,.2f} km²"),
        caption=f"Curvature: {answer.curvature}",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("site", style="bold")
    for column in ("east m", "north m", "altitude m", "sees km²", "share"):
        table.add_column(column, justify="right", no_wrap=True)
    for site in answer.sites:
        table.add_row(
            site.id,
            f"{site.east_m:.0f}",
            f"{site.north_m:.0f}",
            f"{site.altitude_m:.1f}",
            f"{site.seen_m2 / 1e6:.2f}",
            share_text(site.seen_share),
        )
    return (table,)
