"""The morphing map as a picture: from which height above ground positioning is good enough up to the ceiling."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from service.drawing.class_map import NONE_COLOUR, UNDECIDED, MapClass, class_legend, class_pixels
from service.drawing.sheet import ground_figure, sources_words
from service.parts.map_facts import dem_name
from service.parts.ranging_sources import Source, check_moving_sources
from service.parts.sentences import counted
from visibility import Anchor
from visibility.air import ColumnState

from .calculate import STATE_WORDS, FinishedMorphingMap
from .frames import AVAILABLE_BANDS, available_at, frame_words

__all__ = ["draw_availability", "draw_frame", "draw_morphing_map", "morphing_classes", "round_edges", "write_animation"]

# Low is good: it leaves the most air to fly in.
COLOURS = ("#e9f3d5", "#b5dcc3", "#72b9c6", "#3f86b5", "#2c4f8e", "#27306b")
CLOSED_COLOUR, OUTSIDE_COLOUR = "#e3a45b", "#8b8378"
ROUND = (1.0, 2.0, 5.0, 10.0)
ANIMATION_DPI, ANIMATION_COLOURS = 75, 255
# an animation lasts about so long, but a frame is seen at least and at most so long
WHOLE_MS, LEAST_MS, MOST_MS = 12_000, 60, 700
SHARES = (0.25, 0.5, 0.75)
SHARE_COLOURS = ("#f2c46d", "#e9f3d5", "#b5dcc3", "#4fa3c4", "#2c5f9e")


def draw_morphing_map(finished: FinishedMorphingMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    parameters, grid = finished.parameters, finished.grid
    above_m = finished.above_ground_m
    classes, numbers = morphing_classes(above_m, finished.state, round_edges(above_m))
    few = "" if parameters.min_anchors is None else f", at least {counted(parameters.min_anchors, 'anchor')}"
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        finished.anchors,
        f"Flyable from this height above ground: {dem_name(grid)}",
        f"{parameters.measure.upper()} of {parameters.kind} < {parameters.dop_limit:g}{few}, up to "
        f"{finished.ceiling_words()}; {sources_words(finished.anchors)}",
    )
    class_legend(axes, grid, numbers, classes, "Height above ground, m")
    return figure


def morphing_classes(
    above_m: npt.NDArray[np.float32], state: npt.NDArray[np.uint8], edges: list[float]
) -> tuple[list[MapClass], npt.NDArray[np.uint8]]:
    """Classes of heights above ground between the edges and of states without one, and the class of each post."""
    between = (f"{low:g}–{high:g}" for low, high in pairwise(edges))
    labels = [STATE_WORDS[ColumnState.EVERYWHERE], f"< {edges[0]:g}", *between, f"> {edges[-1]:g}"]
    classes = [MapClass(label, colour) for label, colour in zip(labels, COLOURS, strict=True)]
    first_state = len(classes)
    without_one = (
        (ColumnState.CLOSED_AT_CEILING, CLOSED_COLOUR),
        (ColumnState.NOWHERE, NONE_COLOUR),
        (ColumnState.OUTSIDE, OUTSIDE_COLOUR),
    )
    classes += [MapClass(STATE_WORDS[kind], colour) for kind, colour in without_one]
    numbers = (1 + np.digitize(above_m, np.array(edges, np.float32))).astype(np.uint8)
    numbers[state == ColumnState.EVERYWHERE] = 0
    for number, (kind, _) in enumerate(without_one):
        numbers[state == kind] = first_state + number
    numbers[state == ColumnState.UNKNOWN] = UNDECIDED
    return classes, numbers


def round_edges(above_m: npt.NDArray[np.float32]) -> list[float]:
    """Four round heights, evenly spaced, that part the heights from the 2nd to the 95th percentile."""
    above_m = above_m[np.isfinite(above_m) & (above_m > 0.0)]
    low_m, high_m = np.quantile(above_m, (0.02, 0.95)).tolist() if above_m.size else (0.0, 100.0)
    steps = len(COLOURS) - 2
    least_m = max((high_m - low_m) / steps, 0.1)
    power = 10.0 ** np.floor(np.log10(least_m))
    step_m = float(next(m * power for m in ROUND if m * power >= least_m * (1.0 - 1e-9)))
    first_m = np.floor(low_m / step_m) * step_m
    return [float(first_m + number * step_m) for number in range(1, steps + 1)]


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
    words = counted(len(near), "anchor") if near else ""
    if satellites or not near:
        words += f"{' and ' if near else ''}{counted(satellites, 'satellite')}"
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
        f"{counted(len(times), 'frame')} from {times[0]} to {times[-1]}; {parameters.measure.upper()} of "
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
        yield whole.quantize(ANIMATION_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
