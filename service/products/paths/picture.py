"""A planned path over the ground: how good positioning is, what may not be driven, and the way between."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.path
import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.patheffects import Normal, Stroke

from planning.paths.fields import bit_of
from planning.paths.outcomes import Reason
from planning.words import time_words
from service.drawing.class_map import UNDECIDED, MapClass, class_legend, class_pixels
from service.drawing.furniture import INK
from service.drawing.sheet import ground_figure
from service.parts.map_facts import dem_name
from service.parts.plan_answers import PathPlaceOut
from service.parts.points import PolygonIn
from service.parts.shapes_in_grid import places_in_grid
from service.products.dop.picture import dilution_classes
from service.products.paths.answer import FinishedPath
from visibility import Anchor

__all__ = ["draw_path", "path_classes"]

# Without a limit on the dilution the classes are round about these.
USUAL_LIMIT = 5.0
GROUND_COLOUR, BARRED_COLOUR = "#d9d2c0", "#7d6a70"
WAY_COLOUR, DARK_COLOUR, NO_GO_COLOUR, KEEP_IN_COLOUR = "#e6007e", "#2b0a1c", "#c01818", "#176b2c"
# reasons that the ground itself gives, as the legend names them
OF_GROUND = {
    Reason.SLOPE: "too steep",
    Reason.STEP: "step",
    Reason.UNKNOWN_GROUND: "unknown beside",
    Reason.BORDER: "border",
}
# the others, each in its colour, the first of a post's; dilutions show by themselves, and no-go and keep-in as areas
OF_LIMITS = {
    Reason.ANCHORS: ("too few in sight", "#43325e"),
    Reason.MORPHING_MAP: ("under morphing map", "#5f6f8f"),
    Reason.BUBBLE: ("bubble not clear", "#a2557a"),
    Reason.SIGHT_LINE: ("by exact lines", "#8a8a3c"),
    Reason.PITCH_OR_ROLL: ("pitch or roll", "#96755a"),
}


def draw_path(finished: FinishedPath) -> Figure:
    """The path as a figure with one Axes in kilometres of the grid's frame."""
    grid, answer = finished.grid, finished.answer
    classes, numbers, title = path_classes(finished)
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        (
            *finished.anchors,
            *_moving(finished),
        ),
        f"Path, {answer.status.replace('_', ' ')}: {dem_name(grid)}",
        _subtitle(finished),
    )
    handles = _draw_areas(axes, finished)
    handles += _draw_way(axes, finished) if finished.found else _draw_cut(axes, finished)
    handles += _draw_ends(axes, finished)
    class_legend(axes, grid, numbers, classes, title, handles)
    return figure


def _moving(finished: FinishedPath) -> list[Anchor]:
    """Where the anchors on tracks are when the rover leaves; how high is of no account here, and may not be known."""
    asked, found = finished.parameters, []
    left_s = next((one.departure_s for one in finished.answer.departures if one.taken), asked.departure_s)
    for track in asked.tracks:
        places_m = places_in_grid(finished.grid, track.points)
        times_s = [point.time_s for point in track.points]
        east_m, north_m = (float(np.interp(left_s, times_s, column)) for column in places_m.T)
        found.append(Anchor(track.id, east_m, north_m, 0.0))
    return found


def path_classes(finished: FinishedPath) -> tuple[list[MapClass], npt.NDArray[np.uint8], str]:
    """Classes of the dilution, then by reason what may not be driven; without anchors only that."""
    asked, grid = finished.parameters, finished.grid
    if not (finished.answer.ranged_to or asked.morphing_map):
        classes, numbers = [MapClass("may be driven", GROUND_COLOUR)], np.zeros(grid.shape, np.uint8)
        title = "Ground"
    else:
        classes, numbers = dilution_classes(finished.dop, asked.limits.dop_limit or USUAL_LIMIT)
        title = asked.limits.measure.upper()
    for reason, (label, colour) in reversed(OF_LIMITS.items()):
        barred = _barred(finished, [reason])
        if barred.any():
            classes.append(MapClass(label.replace("in sight", asked.in_words), colour))
            numbers[barred] = len(classes) - 1
    there = [reason for reason in OF_GROUND if (finished.reasons & bit_of(reason)).any()] or [Reason.SLOPE]
    classes.append(MapClass(", ".join(OF_GROUND[reason] for reason in there[:2]), BARRED_COLOUR))
    numbers[_barred(finished, list(OF_GROUND))] = len(classes) - 1
    numbers[np.isnan(grid.heights_m)] = UNDECIDED
    return classes, numbers, title


def _barred(finished: FinishedPath, reasons: Sequence[Reason]) -> npt.NDArray[np.bool_]:
    """(rows, cols) posts of which every square that touches them may not be driven for one of these reasons."""
    bits = np.bitwise_or.reduce([bit_of(reason) for reason in reasons])
    square = (finished.reasons & bits) != 0
    barred = np.ones(finished.grid.shape, np.bool_)
    for rows in (slice(0, -1), slice(1, None)):
        for cols in (slice(0, -1), slice(1, None)):
            barred[rows, cols] &= square
    return barred


def _subtitle(finished: FinishedPath) -> str:
    answer = finished.answer
    totals = answer.totals
    if totals is None:
        return answer.sentence[:150]
    words = [f"{totals.length_m / 1000.0:.2f} km", f"{totals.climb_m:.0f} m up", time_words(totals.time_s)]
    if finished.answer.ranged_to:
        out = "without enough usable" if finished.parameters.usable else "out of sight"
        words.append(f"longest {out} {time_words(totals.longest_out_of_sight_s)}")
        worst = totals.worst_dop
        words.append(
            "no fix somewhere" if worst is None else f"worst {finished.parameters.limits.measure.upper()} {worst:.2f}"
        )
    if answer.ratio is not None:
        words.append(f"cost {answer.ratio:.3f} × reference")
    return ", ".join(words)


def _draw_way(axes: Axes, finished: FinishedPath) -> list[tuple[str, Artist]]:
    """The way, dark where fewer anchors are in sight than count as in sight."""
    places = np.column_stack([finished.column("east_m"), finished.column("north_m")]) / 1000.0
    handles: list[tuple[str, Artist]] = [("way", Line2D([], [], color=WAY_COLOUR, lw=2.6))]
    needed = finished.answer.needed_in_sight
    dark = finished.column("anchor_count") < needed if finished.answer.ranged_to else np.zeros(len(places), np.bool_)
    pieces = np.stack([places[:-1], places[1:]], axis=1)
    out = dark[:-1] | dark[1:]
    halo = [Stroke(linewidth=4.4, foreground="white"), Normal()]
    axes.plot(*places.T, color=WAY_COLOUR, lw=2.6, zorder=8, path_effects=halo, solid_capstyle="round")
    if out.any():
        axes.add_collection(LineCollection(list(pieces[out]), colors=DARK_COLOUR, linewidths=2.6, zorder=8.5))
        handles.append((f"< {needed} {finished.parameters.in_words}", Line2D([], [], color=DARK_COLOUR, lw=2.6)))
    return handles


def _draw_cut(axes: Axes, finished: FinishedPath) -> list[tuple[str, Artist]]:
    cut = finished.answer.unreachable
    if cut is None:
        return []
    at_km = ([cut.where.east_m / 1000.0], [cut.where.north_m / 1000.0])
    (mark,) = axes.plot(*at_km, marker="X", ms=13, mfc="#ff3030", mec="white", mew=1.5, ls="none", zorder=12)
    what = "cut" if finished.answer.status == "unreachable" else "stopped"
    return [(f"{what}: {cut.reason}"[:26], mark)]


def _draw_ends(axes: Axes, finished: FinishedPath) -> list[tuple[str, Artist]]:
    answer = finished.answer
    handles: list[tuple[str, Artist]] = []
    for label, places, marker, size, colour in (
        ("start", [answer.start], "o", 8, "white"),
        ("way-point", answer.way_points, "D", 8, "white"),
        ("goal", [goal for goal in answer.goals if isinstance(goal, PathPlaceOut)], "*", 15, WAY_COLOUR),
    ):
        if places:
            east_km, north_km = np.array([(place.east_m, place.north_m) for place in places]).T / 1000.0
            (mark,) = axes.plot(
                east_km, north_km, marker=marker, ms=size, mfc=colour, mec=INK, mew=1.4, ls="none", zorder=11
            )
            handles.append((label, mark))
    return handles


def _draw_areas(axes: Axes, finished: FinishedPath) -> list[tuple[str, Artist]]:
    asked = finished.parameters
    handles: list[tuple[str, Artist]] = []
    goals = [goal for goal in asked.goals if isinstance(goal, PolygonIn)]
    for label, polygons, colour, hatch in (
        ("no-go area", asked.no_go, NO_GO_COLOUR, "////"),
        ("keep-in area", asked.keep_in, KEEP_IN_COLOUR, None),
        ("goal area", goals, WAY_COLOUR, None),
    ):
        outlines = [
            PathPatch(_outline(finished, polygon), fc="none", ec=colour, lw=1.5, hatch=hatch, zorder=6)
            for polygon in polygons
        ]
        for outline in outlines:
            axes.add_patch(outline)
        if outlines:
            handles.append((label, outlines[0]))
    return handles


def _outline(finished: FinishedPath, polygon: PolygonIn) -> matplotlib.path.Path:
    rings: Sequence[npt.NDArray[np.float64]] = [
        places_in_grid(finished.grid, ring) / 1000.0 for ring in (polygon.ring, *polygon.holes)
    ]
    return matplotlib.path.Path.make_compound_path(
        *(matplotlib.path.Path(ring, closed=False) for ring in map(_closed, rings))
    )


def _closed(ring: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.concatenate([ring, ring[:1]])
