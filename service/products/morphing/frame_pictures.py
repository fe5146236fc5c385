"""The morphing map over time as pictures: an animation, and the share of the time at which places are available."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from service.drawing.class_map import NONE_COLOUR, UNDECIDED, MapClass, class_legend, class_pixels
from service.drawing.sheet import ground_figure, save_png
from service.parts.map_facts import dem_name
from service.parts.ranging_sources import Source, check_moving_sources
from visibility import Anchor

from .calculate import FinishedMorphingMap
from .frames import AVAILABLE_BANDS, available_at, frame_words
from .picture import morphing_classes, round_edges

__all__ = ["draw_availability", "draw_frame", "write_animation", "write_availability_picture"]

ANIMATION_DPI, COLOURS = 75, 255
# an animation lasts about so long, but a frame is seen at least and at most so long
WHOLE_MS, LEAST_MS, MOST_MS = 12_000, 60, 700
SHARES = (0.25, 0.5, 0.75)
SHARE_COLOURS = ("#f2c46d", "#e9f3d5", "#b5dcc3", "#4fa3c4", "#2c5f9e")


def write_animation(finished: FinishedMorphingMap, path: Path) -> None:
    """An animated GIF of all frames, for ever from the start."""
    first, *others = _images(finished)
    each_ms = int(np.clip(WHOLE_MS / (1 + len(others)), LEAST_MS, MOST_MS))
    first.save(path, format="GIF", save_all=True, append_images=others, duration=each_ms, loop=0)


def draw_frame(finished: FinishedMorphingMap, number: int, sources: tuple[Source, ...], edges: list[float]) -> Figure:
    """One frame as a figure; sources: who is there then. edges: heights that part its classes, the same for all."""
    parameters, grid = finished.parameters, finished.grid
    above_m = finished.frame_altitude_m[number] - grid.heights_m
    classes, numbers = morphing_classes(above_m, finished.frame_state[number], edges)
    near = tuple(source for source in sources if isinstance(source, Anchor))
    satellites = len(sources) - len(near)
    words = f"{len(near)} anchors" if near else ""
    if satellites or not near:
        words += f"{' and ' if near else ''}{satellites} satellites"
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        near,
        f"Flyable from this height above ground, {frame_words(parameters)[number]}",
        f"{dem_name(grid)}, {parameters.measure.upper()} of {parameters.kind} < {parameters.dop_limit:g} up to "
        f"{finished.ceiling_words()}; {words}",
    )
    class_legend(axes, grid, numbers, classes, "Height above ground, m")
    return figure


def write_availability_picture(finished: FinishedMorphingMap, path: Path) -> None:
    """Draw the availability into a PNG."""
    save_png(draw_availability(finished), path)


def draw_availability(finished: FinishedMorphingMap) -> Figure:
    """The share of the frames at which each place is in flyable air, as a figure."""
    parameters, grid = finished.parameters, finished.grid
    assert parameters.frames is not None, "the layer needs frames"
    share, unknown = (finished.available[AVAILABLE_BANDS.index(name)] for name in ("share", "unknown_share"))
    labels = ["never", "< 25 %", "25–50 %", "50–75 %", "75–100 %", "always"]
    classes = [MapClass(label, colour) for label, colour in zip(labels, (NONE_COLOUR, *SHARE_COLOURS), strict=True)]
    numbers = (1 + np.digitize(share, SHARES)).astype(np.uint8)
    numbers[share == 0.0] = 0
    numbers[share == 1.0] = len(classes) - 1
    numbers[(share == 0.0) & (unknown > 0.0)] = UNDECIDED
    ((height, metres),) = available_at(parameters, parameters.frames).items()
    where = f"{metres:g} m above ground" if height == "above_ground_m" else f"at altitude {metres:g} m"
    times = frame_words(parameters)
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        finished.anchors,
        f"Share of the time in flyable air, {where}: {dem_name(grid)}",
        f"{len(times)} frames from {times[0]} to {times[-1]}; {parameters.measure.upper()} of "
        f"{parameters.kind} < {parameters.dop_limit:g} up to {finished.ceiling_words()}",
    )
    class_legend(axes, grid, numbers, classes, "Share of frames")
    return figure


def _images(finished: FinishedMorphingMap) -> Iterator[Image.Image]:
    parameters, grid = finished.parameters, finished.grid
    assert parameters.frames is not None, "the layer needs frames"
    edges = round_edges(finished.frame_altitude_m - grid.heights_m)
    for number, sources in enumerate(check_moving_sources(grid, parameters, parameters.frames)):
        figure = draw_frame(finished, number, sources, edges)
        figure.set_dpi(ANIMATION_DPI)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        whole = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
        yield whole.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
