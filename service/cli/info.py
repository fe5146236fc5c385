"""``sightline info``: what is read from a DEM."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import TypeAdapter

from service.parts.area import AreaChoice
from service.parts.map_area import map_area
from service.parts.map_facts import dem_summary
from terrain import ElevationGrid

from .grounds import read_ground
from .output import facts_table, print_json, print_tables, print_warnings

__all__ = ["dem_description", "show_info"]


def show_info(dem: str, reading: dict[str, Any], area: dict[str, Any] | None, as_json: bool) -> None:
    """Read the DEM as every command does and print what came of it. area: as a request has it; of tiles only that."""
    asked = None if area is None else TypeAdapter(AreaChoice).validate_python(area)
    grid = read_ground(dem, reading, asked)
    if asked is not None:
        grid = map_area(grid, asked).box
    description = dem_description(grid)
    if as_json:
        print_json(description)
        return
    print_tables(facts_table(description["name"], _facts(description)))
    print_warnings(description["warnings"])


def dem_description(grid: ElevationGrid) -> dict[str, Any]:
    """Plain values about a grid, ready for JSON."""
    known = grid.heights_m[~np.isnan(grid.heights_m)] if grid.unknown_posts else grid.heights_m
    heights = None
    if known.size:
        heights = {"min": float(known.min()), "mean": float(known.mean(dtype=np.float64)), "max": float(known.max())}
    return {
        **dem_summary(grid),
        "driver": grid.provenance.driver,
        "heights_m": heights,
        "warnings": list(grid.provenance.warnings),
    }


def _facts(description: dict[str, Any]) -> list[tuple[str, str]]:
    bounds = description["bounds_of_posts_m"]
    posts = description["rows"] * description["cols"]
    unknown = description["unknown_posts"]
    return [
        ("format", description["driver"] or "–"),
        ("posts", f"{description['rows']:,} rows × {description['cols']:,} columns = {posts:,}"),
        ("post spacing", f"{description['cell_east_m']:.6g} m east, {description['cell_north_m']:.6g} m north"),
        ("east of posts", f"{bounds['west']:.2f} … {bounds['east']:.2f} m"),
        ("north of posts", f"{bounds['south']:.2f} … {bounds['north']:.2f} m"),
        ("CRS", description["crs_name"]),
        *_north(description["grid_north_deg"]),
        ("vertical datum", description["vertical_datum"] or "not stated"),
        ("heights count from", description["heights_count_from"]),
        ("heights", _heights_text(description["heights_m"])),
        ("unknown posts", f"{unknown:,} ({100.0 * unknown / posts:.2f} %)"),
        ("converted", "\n".join(description["conversions"]) or "nothing"),
        ("sha256", description["sha256"]),
    ]


def _north(grid_north_deg: float | None) -> list[tuple[str, str]]:
    if grid_north_deg is None:
        return []
    return [("grid north", f"{grid_north_deg:.2f}° clockwise of true north, in the middle")]


def _heights_text(heights: dict[str, float] | None) -> str:
    if heights is None:
        return "all unknown"
    return f"{heights['min']:.1f} … {heights['max']:.1f} m, mean {heights['mean']:.1f} m"
