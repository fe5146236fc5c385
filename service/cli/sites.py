"""``sightline sites``: how much of the ground each post would see as a site, and which see most."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.markup import escape
from rich.table import Table

from .asking.ground import AreaOptions, Margin
from .asking.options import WHOLE, DemPath, Output, Reading, ReceiverHeight, RequestFile, option
from .output import share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.parts.geojson_reading import Fields
    from service.products.sites.calculate import SiteMapSummary

__all__ = ["sites"]


def sites(
    dem: DemPath,
    /,
    *,
    count: Annotated[int | None, WHOLE, option("How many sites to name. (default 10)", "K")] = None,
    height: Annotated[float | None, option("Of a site's antenna above the ground, metres. (default 10)", "M")] = None,
    receiver_height: ReceiverHeight = None,
    max_range: Annotated[float | None, option("Longest range, metres.", "M")] = None,
    separation: Annotated[
        float | None, option("Named sites are so far apart, metres. (default a tenth of the shorter side)", "M")
    ] = None,
    directions: Annotated[int | None, WHOLE, option("Rays from each post, a multiple of 4. (default 360)", "N")] = None,
    targets: Annotated[Path | None, option("Only what is in this GeoJSON polygon shall be seen.", "FILE")] = None,
    curvature: Annotated[Literal["auto", "flat"], option("auto: as the DEM's CRS implies; flat: none.")] = "auto",
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

    from .asking.path_files import polygon_fields
    from .asking.products import ask, request_of_fields

    asked: BaseModel | Path | None = request
    if asked is None:
        given = {
            "sites": count,
            "site_above_ground_m": height,
            "receiver_above_ground_m": receiver_height,
            "max_range_m": max_range,
            "min_separation_m": separation,
            "directions": directions,
            "target_area": None if targets is None else _one(targets, polygon_fields(targets)),
            "curvature": curvature,
            "area": area.part(in_degrees=False),
        }
        asked = request_of_fields(
            {name: value for name, value in given.items() if value is not None}, SiteMapParameters
        )
    from service.products.sites import SITE_MAP

    ask(SITE_MAP, dem, asked, _tables, summary="sites.json", reading=reading, output=output, margin_m=margin_m)


def _one(path: Path, polygons: list[Fields]) -> Fields:
    from service.errors import RequestError

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
