"""The outlines of the ground library's tiles as a picture, coloured by how fine they are."""

from __future__ import annotations

import math
from pathlib import Path

from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from service.drawing.furniture import INK
from service.drawing.sheet import save_png
from service.errors import RequestError
from service.files.replacing import replacing
from terrain import GroundLibrary

__all__ = ["write_outlines"]

WIDTH_IN, TALLEST_IN, SHORTEST_IN = 9.0, 9.0, 3.0
# a little ground around the outermost tiles, as a share of the whole
AROUND = 0.04


def write_outlines(library: GroundLibrary, path: Path) -> None:
    """Every tile's outline in longitude and latitude, coarse ones below. Raises RequestError without tiles, OSError."""
    if not library.tiles:
        raise RequestError("The ground library holds no tile yet; `sightline ground add FOLDER` indexes some.")
    tiles = sorted(library.tiles, key=lambda tile: -tile.cell_m)
    bounds = [tile.bounds_deg for tile in tiles]
    west, south = min(b[0] for b in bounds), min(b[1] for b in bounds)
    east, north = max(b[2] for b in bounds), max(b[3] for b in bounds)
    stretch = 1.0 / max(math.cos(math.radians((south + north) / 2.0)), 0.05)
    tall_in = min(max(WIDTH_IN * (north - south) * stretch / (east - west), SHORTEST_IN), TALLEST_IN)
    figure = Figure(figsize=(WIDTH_IN, tall_in), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    cells_m = [tile.cell_m for tile in tiles]
    norm = LogNorm(min(cells_m) / 1.5, max(cells_m) * 1.5)
    outlines = PolyCollection(
        [tile.outline_deg for tile in tiles], cmap=colormaps["viridis"], norm=norm, edgecolors=INK, linewidths=0.6,
        alpha=0.75,
    )  # fmt: skip
    outlines.set_array(cells_m)
    axes.add_collection(outlines)
    margin = AROUND * max(east - west, north - south)
    axes.set(
        xlim=(west - margin, east + margin), ylim=(south - margin, north + margin),
        xlabel="longitude, degrees", ylabel="latitude, degrees", title=f"Ground library: {len(tiles):,} tiles",
    )  # fmt: skip
    axes.set_aspect(stretch, adjustable="box")
    figure.colorbar(outlines, ax=axes, label="cell, metres")
    with replacing(path) as unfinished:
        save_png(figure, unfinished)
