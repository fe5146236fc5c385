"""``sightline info``: what is read from a DEM."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from .asking.ground import AreaOptions, area_asked
from .asking.options import DemPath, Output, Reading, option
from .output import facts_table, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    from service.parts.map_facts import Ground
    from terrain import ElevationGrid

__all__ = ["info"]


def info(
    dem: DemPath,
    /,
    *,
    reading: Reading = Reading(),
    lonlat: Annotated[bool, option("The pairs of --area and --around are longitude,latitude.")] = False,
    area: AreaOptions = AreaOptions(),
    output: Output = Output(),
) -> None:
    """Show what is read from a DEM, what was converted on the way, and every warning."""
    from service.parts.map_facts import ground_of

    asked = area_asked(area.part(in_degrees=lonlat))
    grid = reading.read(dem, asked)
    if asked is not None:
        from service.parts.map_area import map_area

        grid = map_area(grid, asked).box
    ground, heights_m, warnings = ground_of(grid), _heights_m(grid), list(grid.provenance.warnings)
    if output.as_json:
        driver = grid.provenance.driver
        print_json({**ground.model_dump(mode="json"), "driver": driver, "heights_m": heights_m, "warnings": warnings})
        return
    print_tables(facts_table(ground.name, _facts(ground, grid.provenance.driver, heights_m)))
    print_warnings(warnings)


def _heights_m(grid: ElevationGrid) -> dict[str, float] | None:
    """Least, mean and largest known height; None where all are unknown."""
    import numpy as np

    known_m = grid.heights_m[~np.isnan(grid.heights_m)] if grid.unknown_posts else grid.heights_m
    if not known_m.size:
        return None
    return {"min": float(known_m.min()), "mean": float(known_m.mean(dtype=np.float64)), "max": float(known_m.max())}


def _facts(ground: Ground, driver: str | None, heights_m: dict[str, float] | None) -> list[tuple[str, str]]:
    bounds, posts = ground.bounds_of_posts_m, ground.rows * ground.cols
    north_deg = ground.grid_north_deg
    north = [] if north_deg is None else [("grid north", f"{north_deg:.2f}° clockwise of true north, in the middle")]
    heights = (
        "all unknown"
        if heights_m is None
        else f"{heights_m['min']:.1f} … {heights_m['max']:.1f} m, mean {heights_m['mean']:.1f} m"
    )
    return [
        ("format", driver or "–"),
        ("posts", f"{ground.rows:,} rows × {ground.cols:,} columns = {posts:,}"),
        ("post spacing", f"{ground.cell_east_m:.6g} m east, {ground.cell_north_m:.6g} m north"),
        ("east of posts", f"{bounds.west:.2f} … {bounds.east:.2f} m"),
        ("north of posts", f"{bounds.south:.2f} … {bounds.north:.2f} m"),
        ("CRS", ground.crs_name),
        *north,
        ("vertical datum", ground.vertical_datum or "not stated"),
        ("heights count from", ground.heights_count_from),
        ("heights", heights),
        ("unknown posts", f"{ground.unknown_posts:,} ({100.0 * ground.unknown_posts / posts:.2f} %)"),
        *(ground.cover.sentences() if ground.cover is not None else [("stands on it", "nothing that is known")]),
        ("converted", "\n".join(ground.conversions) or "nothing"),
        ("sha256", ground.sha256),
    ]
