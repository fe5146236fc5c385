"""``sightline ground``: indexing tiles, and telling what there is and what an area would take."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError
from service.ground.coverage import coverage_of, plan_told
from service.ground.folder import claimed, library_in
from service.parts.area import AreaChoice, area_of
from service.settings import Settings
from terrain import GRID_METRES, GroundLibrary, MosaicPlan, index_ground, plan_mosaic
from terrain.tiles.library import edited, without

from .areas import area_fields
from .output import facts_table, print_json, print_tables, print_warnings, progress_bar, share_text

__all__ = ["add_ground", "list_ground", "remove_ground", "show_ground"]

SHOWN = 20


def add_ground(paths: list[Path], data: Path | None, as_json: bool) -> None:
    """Index, and tell what that found. Raises DataFolderError, DemReadError."""
    with edited(claimed(_folder(data))) as editing, progress_bar("Reading headers") as progress:
        editing.library, told = index_ground(editing.library, paths, progress)
        library = editing.library
    if as_json:
        print_json({**asdict(told), "tiles": len(library.tiles), "sources": list(library.sources)})
        return
    counts = [(name, f"{getattr(told, name):,}") for name in ("new", "changed", "unchanged", "gone")]
    print_tables(facts_table(f"Ground library: {len(library.tiles):,} tiles", counts))
    more = len(told.skipped) - SHOWN
    print_warnings([f"Not taken: {one.why}" for one in told.skipped[:SHOWN]])
    if more > 0:
        print_warnings([f"{more:,} more files were not taken; --json names them all."])


def list_ground(data: Path | None, picture: Path | None, as_json: bool) -> None:
    """Tell what the library covers, and draw it. Raises DemReadError."""
    library = library_in(_folder(data))
    if picture is not None:
        from service.ground.picture import write_outlines

        write_outlines(library, picture)
    if as_json:
        print_json(coverage_of(library))
        return
    print_tables(_tiles_table(library))
    if picture is not None:
        print(picture)


def show_ground(
    area: str | None,
    around: str | None,
    polygon: Path | None,
    *,
    margin_m: float,
    crs: str | None,
    body: str,
    data: Path | None,
    as_json: bool,
) -> None:
    """Tell what an area would take. Raises RequestError, AreaError, NoGroundError."""
    fields = area_fields(area, around, polygon, in_degrees=crs is None)
    if fields is None:
        raise RequestError("Say which ground: --area W,S,E,N, --around PLACE,RADIUS or --polygon FILE.")
    asked = area_of(TypeAdapter(AreaChoice).validate_python(fields), crs or GRID_METRES)
    plan = plan_mosaic(library_in(_folder(data)).tiles, asked, margin_m=margin_m, body=body)
    if as_json:
        print_json(plan_told(plan))
        return
    print_tables(_plan_table(plan))
    if plan.uncovered:
        print_warnings([f"{share_text(plan.uncovered)} of the area lies in no tile and would be unknown."])


def remove_ground(paths: list[Path], data: Path | None, as_json: bool) -> None:
    """Forget tiles. Raises DemReadError where none is known there."""
    with edited(claimed(_folder(data))) as editing:
        editing.library, removed = without(editing.library, paths)
        left = len(editing.library.tiles)
    if as_json:
        print_json({"removed": removed, "tiles": left})
    else:
        print_tables(facts_table(f"Ground library: {left:,} tiles", [("removed", f"{removed:,}")]))


def _folder(data: Path | None) -> Path:
    return (Settings().data_folder if data is None else data).absolute()


def _tiles_table(library: GroundLibrary) -> Table:
    table = Table(title=f"Ground library: {len(library.tiles):,} tiles", title_justify="left")
    for column, justify in (("tile", "left"), ("cells m", "right"), ("west", "right"), ("south", "right")):
        table.add_column(column, justify="right" if justify == "right" else "left", no_wrap=column != "tile")
    for column in ("east", "north"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("CRS")
    for tile in library.tiles[:SHOWN]:
        crs = tile.crs_text if tile.crs_text.startswith("EPSG:") else tile.crs.name
        sides = [f"{side:.4f}" for side in tile.bounds_deg]
        table.add_row(escape(tile.name), f"{tile.cell_m:.3g}", *sides, escape(f"{crs} ({tile.body})"))
    if len(library.tiles) > SHOWN:
        table.caption = f"and {len(library.tiles) - SHOWN:,} more; --json prints all, --map draws them"
    return table


def _plan_table(plan: MosaicPlan) -> Table:
    table = Table(title="What the area would take, finest first", title_justify="left")
    table.add_column("tiles")
    for column in ("number", "cells m", "covers", "gives"):
        table.add_column(column, justify="right", no_wrap=True)
    for planned in plan.layers:
        layer = planned.layer
        shares = (share_text(planned.covers), share_text(planned.adds))
        table.add_row(escape(layer.name), f"{len(layer.tiles):,}", f"{layer.cell_m:.3g}", *shares)
    return table
