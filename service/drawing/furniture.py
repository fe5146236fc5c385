"""What makes a picture a map: scale bar, north arrow, anchors with their names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke

from visibility import Anchor

__all__ = ["ANCHOR_COLOUR", "INK", "draw_anchors", "draw_scale_and_north"]

HALO = withStroke(linewidth=2.6, foreground="white")
INK, ANCHOR_COLOUR = "#1a1a1a", "#ffd400"
# More names than these would cover the map.
MOST_NAMES = 40


def draw_scale_and_north(
    axes: Axes, width_m: float, width_in: float, height_in: float, grid_north_deg: float | None
) -> None:
    """A bar of a round length, about a fifth of the map, and an arrow to true north, in the lower left corner.

    grid_north_deg: true azimuth of the picture's upward direction; None for a local frame, whose north is up.
    """
    length_m = _round_length(0.22 * width_m)
    # inches on paper as shares of the axes
    across, up = 1.0 / width_in, 1.0 / height_in
    left, low, bar = 0.2 * across, 0.2 * up, length_m / width_m
    box: Mapping[str, Any] = {"transform": axes.transAxes, "zorder": 8}
    axes.add_patch(
        Rectangle((left - 0.1 * across, low - 0.1 * up), bar + 0.6 * across, 0.48 * up, fc="white", alpha=0.8, **box)
    )
    for half, colour in ((0, INK), (1, "white")):
        corner = (left + half * bar / 2, low)
        axes.add_patch(Rectangle(corner, bar / 2, 0.08 * up, fc=colour, ec=INK, lw=0.8, **box))
    text = f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
    axes.text(left + bar / 2, low + 0.13 * up, text, ha="center", va="bottom", fontsize=9, color=INK, **box)
    arrow = {"arrowstyle": "-|>", "color": INK, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    at = left + bar + 0.25 * across
    turn_rad = math.radians(-(grid_north_deg or 0.0))
    reach, middle = (0.185 * math.sin(turn_rad) * across, 0.185 * math.cos(turn_rad) * up), low + 0.145 * up
    head, tail = ((at + way * reach[0], middle + way * reach[1]) for way in (1.0, -1.0))
    axes.annotate("", head, tail, xycoords="axes fraction", arrowprops=arrow, zorder=9)
    axes.text(at + 0.06 * across, low, "N", fontsize=9, fontweight="bold", color=INK, va="bottom", **box)


def draw_anchors(axes: Axes, anchors: tuple[Anchor, ...], extent_km: tuple[float, float, float, float]) -> None:
    """A triangle with its name for each anchor on the map, an arrow at the border for each one outside.

    extent_km: (west, east, south, north) of the picture.
    """
    west, east, south, north = extent_km
    for anchor in anchors:
        east_km, north_km = anchor.east_m / 1000.0, anchor.north_m / 1000.0
        name = anchor.id if len(anchors) <= MOST_NAMES else ""
        if west <= east_km <= east and south <= north_km <= north:
            axes.plot(east_km, north_km, marker="^", ms=10, mfc=ANCHOR_COLOUR, mec=INK, mew=1.3, ls="none", zorder=10)
            on_the_right = east_km < east - 0.1 * (east - west)
            axes.annotate(
                name,
                (east_km, north_km),
                xytext=(8 if on_the_right else -8, 1),
                textcoords="offset points",
                ha="left" if on_the_right else "right",
                va="center",
                fontsize=10,
                fontweight="bold",
                color=INK,
                path_effects=[HALO],
                zorder=11,
            )
        else:
            _draw_outside(axes, name, east_km, north_km, extent_km)


def _draw_outside(
    axes: Axes, name: str, east_km: float, north_km: float, extent_km: tuple[float, float, float, float]
) -> None:
    """An arrow just inside the border, pointing from the map's centre towards the anchor, with its distance."""
    west, east, south, north = extent_km
    centre_east, centre_north = (west + east) / 2, (south + north) / 2
    toward_east, toward_north = east_km - centre_east, north_km - centre_north
    # shrink the line centre→anchor until it ends on the border
    shrink = min(
        (east - west) / 2 / abs(toward_east) if toward_east else math.inf,
        (north - south) / 2 / abs(toward_north) if toward_north else math.inf,
    )
    tip = centre_east + 0.995 * shrink * toward_east, centre_north + 0.995 * shrink * toward_north
    length = 0.07 * max(east - west, north - south) / math.hypot(toward_east, toward_north)
    tail = tip[0] - length * toward_east, tip[1] - length * toward_north
    axes.annotate(
        "", xy=tip, xytext=tail, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 2.2, "path_effects": [HALO]},
        zorder=10,
    )  # fmt: skip
    outside_km = math.hypot(max(west - east_km, east_km - east, 0.0), max(south - north_km, north_km - north, 0.0))
    distance = f"{outside_km:.1f} km" if outside_km >= 1.0 else f"{1000 * outside_km:.0f} m"
    axes.annotate(
        f"{name}\n{distance} off" if name else "",
        tail,
        ha="right" if toward_east > 0.3 * abs(toward_north) else "left" if toward_east < -0.3 * abs(toward_north)
        else "center",
        va="top" if toward_north > abs(toward_east) else "bottom" if -toward_north > abs(toward_east) else "center",
        fontsize=9,
        fontweight="bold",
        color=INK,
        path_effects=[HALO],
        zorder=11,
    )  # fmt: skip


def _round_length(length_m: float) -> float:
    """The largest of 1, 2, 5 × 10ⁿ that is not longer."""
    power = 10.0 ** math.floor(math.log10(length_m))
    return next(m * power for m in (5.0, 2.0, 1.0) if m * power <= length_m * (1 + 1e-9))
