"""Calculate and draw the paper's case: ``python -m benchmarks.visibility.paper --out docs/images/paper``."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from benchmarks.visibility.paper_case import (
    ALMANAC_FILE,
    BAD,
    DEM_FILE,
    GOOD,
    LIMIT,
    Scene,
    mountain_almanac,
    open_sky_pdop,
    read_mountains,
    scene,
)
from benchmarks.visibility.paper_flight import TAKE_OFF, Flight, fly
from benchmarks.visibility.paper_pictures import (
    draw_flight,
    draw_horizontal_cut,
    draw_morphing,
    draw_sections,
    draw_sky,
)

__all__ = ["main", "write_case", "write_png"]

DPI = 100
COLOURS = 256  # of a palette: a third of the bytes, and nothing to be seen of it


def write_case(dem: Path, almanac_file: Path, folder: Path) -> tuple[list[Path], list[str]]:
    """Write the pictures; returns their paths, and what was found in sentences."""
    whole, almanac = read_mountains(dem), mountain_almanac(almanac_file)
    good, bad = scene(whole, almanac, GOOD), scene(whole, almanac, BAD)
    flown = fly(whole, almanac, TAKE_OFF)
    pictures = {
        "sky": draw_sky((good, bad)),
        "sections": draw_sections(good),
        "horizontal-cut": draw_horizontal_cut(good),
        "morphing": draw_morphing((good, bad)),
        "flight": draw_flight(flown, good.grid),
    }
    folder.mkdir(parents=True, exist_ok=True)
    paths = [write_png(figure, folder / f"{name}.png") for name, figure in pictures.items()]
    return paths, [*(_told(shown) for shown in (good, bad)), _told_flight(flown)]


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.visibility.paper", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the pictures")
    parser.add_argument("--dem", type=Path, default=DEM_FILE, metavar="FILE", help="bigtujunga.tif, elsewhere")
    parser.add_argument("--almanac", type=Path, default=ALMANAC_FILE, metavar="FILE", help="the almanac, elsewhere")
    arguments = parser.parse_args()
    for path in (arguments.dem, arguments.almanac):
        if not path.is_file():
            parser.error(f"{path} is not there; docs/paper-case.md tells where to get it.")
    paths, sentences = write_case(arguments.dem, arguments.almanac, arguments.out)
    print("\n".join([*sentences, *(f"{path} ({path.stat().st_size / 1000:.0f} kB)" for path in paths)]))
    return 0


def write_png(figure: Figure, path: Path) -> Path:
    """The figure as PNG with a palette."""
    FigureCanvasAgg(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    with Image.open(buffer) as picture:
        picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
    return path


def _told(shown: Scene) -> str:
    seen = shown.surfaces.visible(above_ground_m=0.0).sum(axis=0, dtype=np.int64)
    above_m = shown.morphing.above_ground_m
    return (
        f"{shown.when:%H:%M}: {len(shown.surfaces.anchors)} satellites in the cone, {seen.min()} to {seen.max()} in "
        f"sight of the ground, PDOP {open_sky_pdop(shown):.2f} under an open sky; PDOP >= {LIMIT.dop_limit:g} near "
        f"the ground over {np.mean(above_m > 0.0):.1%} of it, up to {np.nanmax(above_m):.0f} m above it."
    )


def _told_flight(flown: Flight) -> str:
    seen, total, pdop, best = flown.visible, flown.total, flown.pdop, flown.pdop_total
    return (
        f"Flight: {len(seen):,} points; {seen.min()} to {seen.max()} of {total.min()} to {total.max()} satellites in "
        f"sight; PDOP {pdop.min():.2f} to {pdop.max():.2f}, under an open sky {best.min():.2f} to {best.max():.2f}; "
        f"{np.mean(pdop >= LIMIT.dop_limit):.0%} of the way {LIMIT.dop_limit:g} or more; "
        f"calculated in {flown.calculated_s:.2f} s."
    )


if __name__ == "__main__":
    sys.exit(main())
