"""``sightline ground``: indexing tiles, and telling what there is and what an area would take."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter
from rich.markup import escape
from rich.table import Table

from service.errors import RequestError

from .asking.ground import AreaOptions, Margin, area_asked
from .asking.options import option
from .operating.store import AsJson, DataFolder
from .output import facts_table, print_json, print_tables, print_warnings, progress_bar, share_text

if TYPE_CHECKING:
    from terrain import GroundLibrary, MosaicPlan

__all__ = ["ground"]

SHOWN = 20

ground = App(
    name="ground", help="The ground library: an index of DEM files, from which the ground of any place is made."
)


@ground.command
def add(
    *paths: Annotated[
        Path,
        Parameter(
            name="PATH",
            allow_leading_hyphen=False,
            help="Folders and files to add; without any, what is known is looked at.",
        ),
    ],
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Index folders and files of tiles, any format, CRS and resolution; only headers of new and changed ones are read.

    The files stay where they are. What cannot serve as a tile is named with the reason.
    """
    from service.ground.coverage import LIBRARY
    from service.jobs.marker import claimed
    from terrain import index_ground
    from terrain.tiles.library import edited

    with edited(claimed(_folder(data)) / LIBRARY) as editing, progress_bar("Reading headers") as progress:
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


@ground.command(name="list")
def list_tiles(
    *,
    data: DataFolder = None,
    picture: Annotated[
        Path | None, option("Draw the outlines of all tiles into this file.", "FILE.png", "--map")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Tell what the library covers; --json prints it as GeoJSON."""
    from service.ground.coverage import coverage_of, library_in

    library = library_in(_folder(data))
    if picture is not None:
        from service.ground.picture import write_outlines

        write_outlines(library, picture)
    if as_json:
        print_json(coverage_of(library).model_dump(mode="json"))
        return
    print_tables(_tiles_table(library))
    if picture is not None:
        print(picture)


@ground.command
def show(
    *,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    crs: Annotated[str | None, option("Metric CRS; pairs are metres in it, else degrees.", "CRS")] = None,
    body: Annotated[str, option("Body whose ground it is.", "NAME")] = "Earth",
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Tell which tiles would be taken for an area, in which order and why."""
    from service.ground.coverage import library_in, plan_told
    from service.parts.areas import area_of
    from terrain import GRID_METRES, plan_mosaic

    asked = area_asked(area.part(in_degrees=crs is None))
    if asked is None:
        raise RequestError("Say which ground: --area W,S,E,N, --around PLACE,RADIUS or --polygon FILE.")
    wanted = area_of(asked, crs or GRID_METRES)
    plan = plan_mosaic(library_in(_folder(data)).tiles, wanted, margin_m=margin_m or 0.0, body=body)
    if as_json:
        print_json(plan_told(plan).model_dump(mode="json"))
        return
    print_tables(_plan_table(plan))
    if plan.uncovered:
        print_warnings([f"{share_text(plan.uncovered)} of the area lies in no tile and would be unknown."])


@ground.command
def remove(
    path: Annotated[Path, Parameter(name="PATH", allow_leading_hyphen=False, help="A folder or file to forget.")],
    /,
    *more: Annotated[Path, Parameter(name="PATH", allow_leading_hyphen=False, help="And others.")],
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Forget tiles; their files stay where they are, and come back only when they are added again."""
    from service.ground.coverage import LIBRARY
    from service.jobs.marker import claimed
    from terrain.tiles.library import edited, without

    with edited(claimed(_folder(data)) / LIBRARY) as editing:
        editing.library, removed = without(editing.library, [path, *more])
        left = len(editing.library.tiles)
    if as_json:
        print_json({"removed": removed, "tiles": left})
    else:
        print_tables(facts_table(f"Ground library: {left:,} tiles", [("removed", f"{removed:,}")]))


def _folder(data: Path | None) -> Path:
    from service.settings import Settings

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
