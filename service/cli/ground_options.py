"""``sightline ground``: its commands and their options; the work is done in ground.py."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .areas import AreaFile, AreaText, AroundText
from .options import AsJson
from .store_options import DataOption

__all__ = ["ground_commands"]

MarginOption = Annotated[
    float, typer.Option("--margin", metavar="M", help="Ground around the area that is taken too, metres.")
]
TargetCrs = Annotated[
    str | None, typer.Option("--crs", metavar="CRS", help="Metric CRS; pairs are metres in it, else degrees.")
]
BodyOption = Annotated[str, typer.Option("--body", metavar="NAME", help="Body whose ground it is.")]

ground_commands = typer.Typer(
    name="ground",
    no_args_is_help=True,
    help="The ground library: an index of DEM files, from which the ground of any place is made.",
)


@ground_commands.command()
def add(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[PATH]...", help="Folders and files to add; without any, what is known is looked at."),
    ] = None,
    data: DataOption = None,
    as_json: AsJson = False,
) -> None:
    """Index folders and files of tiles, any format, CRS and resolution; only headers of new and changed ones are read.

    The files stay where they are. What cannot serve as a tile is named with the reason.
    """
    from .ground import add_ground

    add_ground(paths or [], data, as_json)


@ground_commands.command("list")
def list_tiles(
    data: DataOption = None,
    picture: Annotated[
        Path | None, typer.Option("--map", metavar="FILE.png", help="Draw the outlines of all tiles into this file.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Tell what the library covers; --json prints it as GeoJSON."""
    from .ground import list_ground

    list_ground(data, picture, as_json)


@ground_commands.command()
def show(
    area: AreaText = None,
    around: AroundText = None,
    polygon: AreaFile = None,
    margin: MarginOption = 0.0,
    crs: TargetCrs = None,
    body: BodyOption = "Earth",
    data: DataOption = None,
    as_json: AsJson = False,
) -> None:
    """Tell which tiles would be taken for an area, in which order and why."""
    from .ground import show_ground

    show_ground(area, around, polygon, margin_m=margin, crs=crs, body=body, data=data, as_json=as_json)


@ground_commands.command()
def remove(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Folders or files to forget.")],
    data: DataOption = None,
    as_json: AsJson = False,
) -> None:
    """Forget tiles; their files stay where they are, and come back only when they are added again."""
    from .ground import remove_ground

    remove_ground(paths, data, as_json)
