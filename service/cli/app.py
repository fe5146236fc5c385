"""The commands of ``sightline`` and their options; each does its work in its own module, imported when it is called."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from .bubble_options import bubble
from .detect_options import detect
from .failures import INTERRUPTED, exit_code_of, interrupted, unheard
from .fly_options import fly
from .ground_options import ground_commands
from .options import (
    AnchorFiles,
    AnchorTexts,
    AsJson,
    Band,
    CellM,
    Crs,
    CurvatureOption,
    CurvatureWord,
    DemPath,
    HeightUnitOption,
    LonLat,
    Mode,
    ModeOption,
    Nodata,
    OutFolder,
    ReceiverHeight,
    UnknownGround,
    UnknownOption,
    reading_options,
)
from .place_options import place
from .plan_options import plan
from .positioning_options import dop, morph
from .reposition_options import reposition
from .store_options import store_commands

__all__ = ["app", "main"]

app = typer.Typer(
    name="sightline",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Which ranging anchors does a rover see, where, and from what height? Exit codes: 0 done, 2 bad input, "
    "1 fault.",
)


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"sightline {version('sightline')}")
        raise typer.Exit


@app.callback()
def _sightline(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None: ...


@app.command()
def info(
    dem: DemPath,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    as_json: AsJson = False,
) -> None:
    """Show what is read from a DEM, what was converted on the way, and every warning."""
    from .info import show_info

    show_info(dem, reading_options(nodata, crs, height_unit, band, cell_m), as_json)


@app.command()
def visibility(
    dem: DemPath,
    anchor: AnchorTexts = None,
    lonlat: LonLat = False,
    anchors: AnchorFiles = None,
    receiver_height: ReceiverHeight = None,
    receiver_altitude: Annotated[
        float | None, typer.Option("--receiver-altitude", metavar="M", help="One altitude everywhere instead, metres.")
    ] = None,
    mode: ModeOption = Mode.FAST,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Calculate which anchors are in sight over a whole DEM.

    Writes visibility.json, visible.tif, min_visible_altitude.tif, count.tif and map.png into --out.
    """
    from .height_words import height_words
    from .visibility import make_visibility_map

    make_visibility_map(
        dem,
        reading=reading_options(nodata, crs, height_unit, band, cell_m),
        anchor_texts=anchor or [],
        lonlat=lonlat,
        anchor_files=anchors or [],
        heights=height_words(anchor),
        asked={
            "receiver_above_ground_m": receiver_height,
            "receiver_altitude_m": receiver_altitude,
            "mode": mode.value,
            "unknown": unknown.value,
            "curvature": curvature.value,
        },
        out=out,
        as_json=as_json,
    )


app.command()(dop)
app.command()(morph)
app.command()(bubble)
app.command()(detect)
app.command()(place)
app.command()(plan)
app.command()(fly)
app.command()(reposition)
app.add_typer(store_commands)
app.add_typer(ground_commands)


@app.command()
def los(
    dem: DemPath,
    start: Annotated[str, typer.Option("--from", metavar="EAST,NORTH,HEIGHT", help="One end; HEIGHT 80agl or 612msl.")],
    end: Annotated[str, typer.Option("--to", metavar="EAST,NORTH,HEIGHT", help="The other end.")],
    lonlat: Annotated[bool, typer.Option("--lonlat", help="The pairs are longitude,latitude.")] = False,
    wavelength: Annotated[
        float | None, typer.Option(metavar="M", help="Wavelength, metres; adds the Fresnel clearance.")
    ] = None,
    dem_sigma: Annotated[
        float | None, typer.Option(metavar="M", help="One-sigma error of the DEM, metres; adds the probability.")
    ] = None,
    unknown: UnknownOption = UnknownGround.UNKNOWN,
    curvature: CurvatureOption = CurvatureWord.AUTO,
    nodata: Nodata = None,
    crs: Crs = None,
    height_unit: HeightUnitOption = None,
    band: Band = None,
    cell_m: CellM = None,
    as_json: AsJson = False,
) -> None:
    """Tell whether one point sees another, and by how much."""
    from .los import show_line_of_sight

    show_line_of_sight(
        dem,
        reading_options(nodata, crs, height_unit, band, cell_m),
        (start, end),
        lonlat=lonlat,
        flat=curvature is CurvatureWord.FLAT,
        options={"unknown": unknown.value, "wavelength_m": wavelength, "dem_sigma_m": dem_sigma},
        as_json=as_json,
    )


@app.command()
def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on. (default 127.0.0.1)")] = None,
    port: Annotated[int | None, typer.Option(help="Port; 0 picks a free one. (default 8000)")] = None,
    data: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for DEMs, jobs and results.")] = None,
    workers: Annotated[int | None, typer.Option(help="Calculations at the same time. (default one per core)")] = None,
) -> None:
    """Start the HTTP service. Every other setting comes from the environment, as SIGHTLINE_<NAME>."""
    from .serve import start_service

    start_service({"host": host, "port": port, "data_folder": data, "workers": workers})


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")] = Path("demo-output"),
    as_json: AsJson = False,
) -> None:
    """Start the service, send it the bundled DEM and four drones over HTTP, and write what it answers."""
    from .demo import run_demo

    run_demo(out, as_json)


@app.command("warm-up")
def warm_up() -> None:
    """Compile every kernel into the cache, so that nothing waits for a compiler later."""
    from service.warm_up import warm_up_on_all_cores as compile_kernels

    compile_kernels()


def main() -> None:
    """Run the command line and leave with its exit code."""
    try:
        code = app(prog_name="sightline", standalone_mode=False)
        sys.stdout.flush()
    except BrokenPipeError:
        sys.exit(unheard())
    except Exception as error:
        ended = exit_code_of(error)
        if ended is None:
            raise
        sys.exit(ended)
    # typer answers with the code when a command left on purpose, and for an interrupt
    sys.exit(interrupted() if code == INTERRUPTED else code if isinstance(code, int) else 0)
