"""The DOP map as a picture: how good positioning is, and the line where it stops being good enough."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from service.drawing import class_map
from service.drawing.class_map import (
    NONE_COLOUR,
    UNDECIDED,
    UNKNOWN_COLOUR,
    MapClass,
    class_legend,
    class_pixels,
    class_shares,
    count_classes,
)
from service.drawing.furniture import ANCHOR_COLOUR, HALO, INK
from service.drawing.sheet import DPI, Sampling, ground_figure, lit_ground, sources_words
from service.parts.map_facts import crs_label, dem_name
from terrain import ElevationGrid
from visibility import Anchor
from visibility.air import HorizontalSection, VerticalSection

from .calculate import FinishedDopMap
from .request import DopMapParameters
from .volumes import cut_line_m, cut_of, volume_of

__all__ = ["dop_classes", "draw_cut", "draw_dop_map", "write_legend", "write_overlay"]

# Shares of the limit at which classes begin: cold colours are good enough, warm ones are not.
BOUNDS = (0.0, 0.5, 0.75, 1.0, 2.0)
COLOURS = ("#2c5f9e", "#4fa3c4", "#b5dcc3", "#f2c46d", "#e08a45")
LINE_COLOUR = "#d4148c"
GROUND = MapClass("ground", "#4a4038")
OUTSIDE = MapClass("outside the volume", "#ffffff")  # air over the ceiling or under the floor
MOST_NAMES = 12
Panel = tuple[str, list[MapClass], npt.NDArray[np.uint8]]


def write_overlay(finished: FinishedDopMap, path: Path) -> None:
    """The dilution in the colours of its classes, darkened by relief."""
    classes, numbers = dop_classes(finished.dop, finished.count, finished.parameters)
    class_map.write_pixels(finished.grid, class_pixels(finished.grid, numbers, classes), path)


def write_legend(finished: FinishedDopMap, path: Path) -> None:
    """Its classes, best first."""
    classes, numbers = dop_classes(finished.dop, finished.count, finished.parameters)
    class_map.write_legend(finished.parameters.measure.upper(), class_shares(finished.grid, numbers, classes), path)


def draw_dop_map(finished: FinishedDopMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    parameters, grid = finished.parameters, finished.grid
    classes, numbers = dop_classes(finished.dop, finished.count, parameters)
    bound = ", moving along the surface" if parameters.on_surface else ""
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        finished.anchors,
        f"{parameters.measure.upper()} of {parameters.kind}: {dem_name(grid)}",
        f"{sources_words(finished.anchors)}, antenna {parameters.receiver_above_ground_m:g} m above ground{bound}, "
        f"mode {parameters.mode}",
    )
    _limit_line(axes, finished)
    line = (f"{parameters.measure.upper()} {parameters.dop_limit:g}", Line2D([], [], color=INK, lw=1.2))
    class_legend(axes, grid, numbers, classes, parameters.measure.upper(), [line])
    return figure


def dop_classes(
    dop: npt.NDArray[np.float32], count: npt.NDArray[np.uint16], parameters: DopMapParameters
) -> tuple[list[MapClass], npt.NDArray[np.uint8]]:
    """Classes round the limit that is asked for, and the class number of each dilution."""
    few = f", < {parameters.min_anchors}" if parameters.min_anchors else ""
    classes, numbers = dilution_classes(dop, parameters.dop_limit, f"no fix{few}")
    numbers[(count < (parameters.min_anchors or 0)) & ~np.isnan(dop)] = len(classes) - 1
    return classes, numbers


def dilution_classes(
    dop: npt.NDArray[np.float32], limit: float, no_fix: str = "no fix"
) -> tuple[list[MapClass], npt.NDArray[np.uint8]]:
    """Classes round a limit, the last of them +inf, and the class number of each dilution; UNDECIDED where NaN."""
    edges = [limit * bound for bound in BOUNDS]
    labels = [f"{low:.3g}–{high:.3g}" for low, high in pairwise(edges)]
    labels = [f"< {edges[1]:.3g}", *labels[1:], f"≥ {edges[-1]:.3g}"]
    classes = [MapClass(label, colour) for label, colour in zip(labels, COLOURS, strict=True)]
    classes.append(MapClass(no_fix, NONE_COLOUR))
    numbers = np.digitize(dop, np.array(edges[1:], np.float32)).astype(np.uint8)
    numbers[np.isinf(dop)] = len(classes) - 1
    numbers[np.isnan(dop)] = UNDECIDED
    return classes, numbers


def _limit_line(axes: Axes, finished: FinishedDopMap) -> None:
    """The line of the limit between drawn posts, interpolated in 1/DOP, which is 0 where no fix is good enough."""
    grid = finished.grid
    step = Sampling.of(grid.shape).step
    rows, cols = np.arange(step // 2, grid.rows, step), np.arange(step // 2, grid.cols, step)
    if min(len(rows), len(cols)) < 2:
        return
    drawn = np.ix_(rows, cols)
    enough = finished.count[drawn] >= (finished.parameters.min_anchors or 0)
    goodness = np.ma.masked_invalid(np.where(enough, 1.0, 0.0) / finished.dop[drawn])
    level = 1.0 / finished.parameters.dop_limit
    if not (goodness.count() and goodness.min() < level < goodness.max()):
        return
    east_km = (grid.origin_east_m + cols * grid.cell_east_m) / 1000.0
    north_km = (grid.origin_north_m - rows * grid.cell_north_m) / 1000.0
    axes.contour(east_km, north_km, goodness, levels=[level], colors=[INK], linewidths=0.9, zorder=5)


def draw_cut(finished: FinishedDopMap, number: int) -> Figure:
    """Anchors in sight and the dilution on a cut, each in a panel; a vertical cut with a map of where it runs."""
    asked, parameters = finished.parameters.cuts[number], finished.parameters
    surfaces = finished.surfaces()
    cut = cut_of(surfaces, parameters, asked)
    measure = parameters.measure.upper()
    shortcut = ", one for each visible set" if parameters.one_dop_per_set else ""
    panels: list[Panel] = [
        (f"anchors {parameters.in_words}", *_counted(cut, len(finished.anchors))),
        (measure, *dop_classes(cut.dop, cut.count, parameters)),
    ]
    if isinstance(cut, VerticalSection):
        line_m = cut_line_m(finished.grid, asked)
        assert line_m is not None, "a vertical cut has a line"
        figure = _vertical(finished, cut, line_m, panels)
        where = "along the line from A to B"
    else:
        figure = _horizontal(volume_of(surfaces, parameters).grid, finished, cut, panels)
        altitude, above = asked.altitude_m, asked.above_ground_m
        where = f"{above:g} m above ground" if above is not None else f"at altitude {altitude:g} m"
    figure.suptitle(
        f"{dem_name(finished.grid)}: anchors {parameters.in_words} and {measure} of {parameters.kind}{shortcut}\n"
        f"{where}, {sources_words(finished.anchors)}, mode {parameters.mode}",
        fontsize=11,
        color=INK,
    )
    return figure


def _vertical(
    finished: FinishedDopMap, cut: VerticalSection, line_m: npt.NDArray[np.float64], panels: Sequence[Panel]
) -> Figure:
    figure = Figure(figsize=(11.6, 6.8), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes_of: dict[str, Axes] = figure.subplot_mosaic([["map", "0"], ["map", "1"]], width_ratios=[1.0, 2.2])
    _locator(axes_of["map"], finished, line_m)
    distance_km = cut.distance_m / 1000.0
    across_km = _edges(distance_km)
    altitude_m = np.where(np.isnan(cut.altitude_m), np.nanmin(cut.altitude_m), cut.altitude_m)
    up_m = np.apply_along_axis(_edges, 1, np.apply_along_axis(_edges, 0, altitude_m))
    lowest_m, highest_m = float(up_m.min()), float(up_m.max())
    bottom_m, top_m = up_m.min(axis=0), up_m.max(axis=0)
    over_ground = 0.5 * (bottom_m[1:] + bottom_m[:-1]) > cut.ground_m  # never so where the ground is unknown
    more = [GROUND, OUTSIDE] if over_ground.any() or top_m.min() < highest_m else [GROUND]
    for name, (title, classes, numbers) in zip("01", panels, strict=True):
        axes = axes_of[name]
        axes.set_facecolor(OUTSIDE.colour)
        # of voxels whose middle is below ground
        axes.fill_between(across_km, bottom_m, top_m, color=GROUND.colour, lw=0.0, zorder=0.5)
        shown = np.where(numbers == UNDECIDED, len(classes), numbers)
        axes.pcolormesh(
            np.broadcast_to(across_km, up_m.shape),
            up_m,
            np.ma.masked_array(shown, cut.below_ground),
            cmap=ListedColormap([*(kind.colour for kind in classes), UNKNOWN_COLOUR]),
            vmin=-0.5,
            vmax=len(classes) + 0.5,
            rasterized=True,
        )
        axes.fill_between(distance_km, cut.ground_m, lowest_m, color=GROUND.colour, lw=0.0)
        axes.plot(distance_km, cut.ground_m, color=INK, lw=0.8)
        axes.set(ylabel="altitude, m", xlim=(across_km[0], across_km[-1]), ylim=(lowest_m, highest_m))
        _legend(axes, title, classes, bool((numbers == UNDECIDED).any()), more)
    axes_of["1"].set_xlabel("from A to B, km")
    return figure


def _horizontal(
    grid: ElevationGrid, finished: FinishedDopMap, cut: HorizontalSection, panels: Sequence[Panel]
) -> Figure:
    tall = grid.rows * grid.cell_north_m / (grid.cols * grid.cell_east_m)
    figure = Figure(figsize=(12.0, min(max(4.3 * tall + 1.0, 3.4), 10.0)), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    rock = cut.altitude_m < grid.heights_m
    for place, (title, classes, numbers) in enumerate(panels):
        axes = figure.add_subplot(1, 2, place + 1)
        pixels = class_pixels(grid, np.where(rock, len(classes), numbers).astype(np.uint8), [*classes, GROUND])
        axes.imshow(pixels, extent=_extent_km(grid), interpolation="nearest")
        _kilometres(axes, grid)
        _anchors(axes, finished)
        unknown = bool((numbers[~rock] == UNDECIDED).any())
        _legend(axes, title, classes, unknown, [GROUND] if rock.any() else [])
    return figure


def _counted(cut: VerticalSection | HorizontalSection, anchors: int) -> tuple[list[MapClass], npt.NDArray[np.uint8]]:
    """Classes of how many are in sight, and the class number of each count."""
    fewest = int(cut.count[cut.count > 0].min(initial=anchors))  # nobody is in sight below the ground
    classes = count_classes(anchors, fewest)
    edges = np.array([kind.first for kind in classes[1:]])
    numbers = np.digitize(cut.count, edges).astype(np.uint8)
    numbers[(cut.count == 0) & (cut.unknown_count > 0)] = UNDECIDED
    return [MapClass(kind.label, to_hex(kind.rgb)) for kind in classes], numbers


def _locator(axes: Axes, finished: FinishedDopMap, line_m: npt.NDArray[np.float64]) -> None:
    """Where the cut runs: relief, the line from A to B, and the anchors."""
    grid = finished.grid
    light, _ = lit_ground(grid, Sampling.of(grid.shape))
    axes.imshow(light, cmap="gray", vmin=0.0, vmax=1.0, extent=_extent_km(grid))
    _kilometres(axes, grid)
    _anchors(axes, finished)
    line_km = line_m / 1000.0
    axes.plot(*line_km.T, color=LINE_COLOUR, lw=2.0)
    for name, (end, next_to) in zip("AB", ((line_km[0], line_km[1]), (line_km[-1], line_km[-2])), strict=True):
        away = end - next_to
        away = away / max(float(np.hypot(*away)), 1e-9)
        axes.annotate(
            name,
            end,
            xytext=tuple(9.0 * away),
            textcoords="offset points",
            ha="center",
            va="center",
            weight="bold",
            color=LINE_COLOUR,
        )


def _anchors(axes: Axes, finished: FinishedDopMap) -> None:
    """Those on the map, without moving its borders."""
    near_km = np.array([(a.east_m, a.north_m) for a in finished.anchors if isinstance(a, Anchor)]).reshape(-1, 2) / 1e3
    borders = axes.get_xlim(), axes.get_ylim()
    if len(near_km) <= MOST_NAMES:
        names = (anchor.id for anchor in finished.anchors if isinstance(anchor, Anchor))
        for name, place in zip(names, near_km, strict=True):
            axes.annotate(
                name, place, xytext=(6, 3), textcoords="offset points", fontsize=8, color=INK, path_effects=[HALO],
                annotation_clip=True,
            )  # fmt: skip
    axes.plot(*near_km.T, marker="^", ms=8, mfc=ANCHOR_COLOUR, mec=INK, mew=1.1, ls="none")
    axes.set(xlim=borders[0], ylim=borders[1])


def _legend(axes: Axes, title: str, classes: Sequence[MapClass], unknown: bool, more: Sequence[MapClass]) -> None:
    listed = [*classes, *([MapClass("unknown", UNKNOWN_COLOUR)] if unknown else []), *more]
    handles = [Patch(fc=kind.colour, ec=INK, lw=0.6, label=kind.label) for kind in listed]
    legend = axes.legend(
        handles=handles, title=title, loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, frameon=False,
        alignment="left", fontsize=9, title_fontsize=9.5,
    )  # fmt: skip
    legend.get_title().set_fontweight("bold")


def _kilometres(axes: Axes, grid: ElevationGrid) -> None:
    axes.set(xlabel=f"east, km  ({crs_label(grid)})", ylabel="north, km")
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.locator_params(nbins=5)


def _extent_km(grid: ElevationGrid) -> tuple[float, float, float, float]:
    west_m, south_m, east_m, north_m = grid.bounds_m
    half_east_m, half_north_m = 0.5 * grid.cell_east_m, 0.5 * grid.cell_north_m
    west_km, east_km = (west_m - half_east_m) / 1000.0, (east_m + half_east_m) / 1000.0
    return west_km, east_km, (south_m - half_north_m) / 1000.0, (north_m + half_north_m) / 1000.0


def _edges(middles: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Bounds of cells round their middles, ends half a cell out."""
    if middles.size == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = 0.5 * (middles[1:] + middles[:-1])
    first, last = middles[0] - (between[0] - middles[0]), middles[-1] + (middles[-1] - between[-1])
    edges: npt.NDArray[np.float64] = np.concatenate([[first], between, [last]])
    return edges
