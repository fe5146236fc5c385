"""Drawings of the paper's case, counterparts of De Vivo's figures 6 to 10."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, LightSource
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from benchmarks.visibility.paper_case import CUT_ALTITUDE_M, LIMIT, SECTION, Scene, open_sky_pdop, sections
from benchmarks.visibility.paper_flight import Flight
from terrain import ElevationGrid
from visibility import DistantAnchor

__all__ = ["draw_flight", "draw_horizontal_cut", "draw_morphing", "draw_sections", "draw_sky"]

Array = npt.NDArray[np.float64]

GROUND, LIMIT_COLOUR, FLIGHT_COLOUR, BLUE = "#4a4038", "#d4148c", "#d62728", "#1f5fbf"
# the limit is one of the bounds, so the colour tells which side of it a voxel is
PDOP_BOUNDS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0)
BAND_M = 100.0
STEP = 3  # every so many posts in perspective
SHADES = 14  # so that all colours of a picture go into a palette
LIGHT = LightSource(azdeg=315.0, altdeg=45.0)


def draw_sky(scenes: tuple[Scene, ...]) -> Figure:
    """Where the satellites of the cone stand at each instant, the zenith in the middle."""
    figure = Figure(figsize=(8.4, 5.0))
    for number, shown in enumerate(scenes):
        axes: Any = figure.add_subplot(1, len(scenes), number + 1, projection="polar")
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        axes.set_rlim(0.0, 90.0)
        axes.set_yticks([30.0, 60.0, 85.0], ["60°", "30°", "5°"], color="#777777", fontsize=8)
        axes.set_xticks(np.radians([0.0, 90.0, 180.0, 270.0]), ["N", "E", "S", "W"])
        stand = [anchor for anchor in shown.surfaces.anchors if isinstance(anchor, DistantAnchor)]
        off_deg = np.array([90.0 - np.degrees(anchor.elevation_rad) for anchor in stand])
        azimuth_rad = np.array([anchor.azimuth_rad for anchor in stand])
        axes.plot(azimuth_rad, off_deg, "o", ms=7, color=BLUE)
        on_paper = off_deg * np.exp(1j * azimuth_rad)
        for anchor, here in zip(stand, on_paper, strict=True):
            # a name goes away from the satellite's nearest neighbour
            nearest = on_paper[np.argsort(np.abs(on_paper - here))[1]]
            shift = (5, 4) if here.real >= nearest.real else (5, -11)
            axes.annotate(anchor.id, (np.angle(here), abs(here)), xytext=shift, textcoords="offset points", fontsize=8)
        axes.set_title(f"{_title(shown)}\nPDOP {open_sky_pdop(shown):.2f} under an open sky", fontsize=10)
    figure.subplots_adjust(left=0.05, right=0.95, bottom=0.06, top=0.85, wspace=0.25)
    return figure


def draw_sections(shown: Scene) -> Figure:
    """Visible satellites and PDOP across the canyon (figures 6 and 7), with the morphing map as a line."""
    cut, _ = sections(shown)
    figure = Figure(figsize=(9.6, 6.4), layout="constrained")
    panels: dict[str, Axes] = figure.subplot_mosaic([["map", "count"], ["map", "pdop"]], width_ratios=[1.0, 1.9])
    _relief(panels["map"], shown.grid)
    ends = np.array([shown.grid.position_of(*post) for post in SECTION]) / 1000.0
    panels["map"].plot(*ends.T, color=LIMIT_COLOUR, lw=2.0)
    for end, name, across in zip(ends, "AB", (8, -8), strict=True):
        panels["map"].annotate(
            name, end, xytext=(across, 0), textcoords="offset points", ha="center", va="center", weight="bold"
        )
    row, col = (np.rint(np.array(post)).astype(int) for post in _posts(shown.grid, cut.east_m, cut.north_m))
    floor_m = shown.morphing.altitude_m[row, col]
    lines = np.append(cut.altitude_m[:, 0] - 6.0, cut.altitude_m[-1, 0] + 6.0)
    columns = np.linspace(0.0, cut.distance_m[-1] / 1000.0, cut.distance_m.size + 1)
    for name, values in (("count", cut.count.astype(float)), ("pdop", cut.dop.astype(float))):
        axes = panels[name]
        axes.set_facecolor(GROUND)
        shades = axes.pcolormesh(columns, lines, np.where(cut.below_ground, np.nan, values), **_colours(name, values))
        axes.fill_between(cut.distance_m / 1000.0, cut.ground_m, lines[0], color=GROUND, lw=0.0)
        axes.plot(cut.distance_m / 1000.0, floor_m, color=LIMIT_COLOUR, lw=1.6)
        axes.set_ylabel("altitude, m")
        axes.set_ylim(lines[0], lines[-1])
        label = "satellites in sight" if name == "count" else "PDOP of those in sight"
        _bar(figure, shades, axes, name, label)
    panels["count"].set_title(f"{_title(shown)}; line: morphing map for PDOP < {LIMIT.dop_limit:g}", fontsize=10)
    panels["pdop"].set_xlabel("from A to B, km")
    return figure


def draw_horizontal_cut(shown: Scene) -> Figure:
    """Visible satellites and PDOP at one altitude; higher ground as relief."""
    _, cut = sections(shown)
    figure = Figure(figsize=(9.6, 5.2), layout="constrained")
    below = shown.grid.heights_m > CUT_ALTITUDE_M
    for number, (name, label) in enumerate((("count", "satellites in sight"), ("pdop", "PDOP of those in sight"))):
        values = (cut.count if name == "count" else cut.dop).astype(float)
        axes = figure.add_subplot(1, 2, number + 1)
        _relief(axes, shown.grid)
        shades = axes.imshow(
            np.where(below, np.nan, values),
            extent=_extent_km(shown.grid),
            interpolation="nearest",
            **_colours(name, values[~below]),
        )
        _bar(figure, shades, axes, name, label)
    figure.suptitle(f"At {CUT_ALTITUDE_M:g} m altitude, {_title(shown)}", fontsize=11)
    return figure


def draw_morphing(scenes: tuple[Scene, ...]) -> Figure:
    """The morphing map in place of the ground (figures 8 and 9), in perspective and as a height above ground."""
    figure = Figure(figsize=(8.4, 8.0), layout="constrained")
    highest_m = max(float(np.nanmax(shown.morphing.above_ground_m)) for shown in scenes)
    bands_m = np.arange(0.0, highest_m + BAND_M, BAND_M)
    norm = BoundaryNorm(bands_m, matplotlib.colormaps["plasma"].N)
    flat = []
    for number, shown in enumerate(scenes):
        axes: Any = figure.add_subplot(2, len(scenes), number + 1, projection="3d")
        grid, above_m = shown.grid, shown.morphing.above_ground_m
        place = (slice(None, None, STEP), slice(None, None, STEP))
        east_km, north_km = _axes_km(grid)
        east_km, north_km = np.meshgrid(east_km[::STEP] - east_km[0], north_km[::STEP] - north_km[-1])
        axes.plot_surface(
            east_km, north_km, shown.morphing.altitude_m[place] / 1000.0, rcount=1000, ccount=1000,
            facecolors=_shaded(grid, shown.morphing.altitude_m, above_m, norm)[place],
            shade=False, lw=0.0, antialiased=False,
        )  # fmt: skip
        axes.set_box_aspect((10.0, 13.0, 3.2), zoom=1.3)
        axes.view_init(elev=38.0, azim=-112.0)
        axes.set_zticks([1.0, 2.0])
        axes.tick_params(labelsize=8)
        axes.set_title(f"{_title(shown)}\nPDOP {open_sky_pdop(shown):.2f} under an open sky", fontsize=10)
        beneath = figure.add_subplot(2, len(scenes), len(scenes) + number + 1)
        beneath.imshow(_shaded(grid, grid.heights_m, above_m, norm), extent=_extent_km(grid), interpolation="nearest")
        share = float(np.mean(above_m > 0.0))
        beneath.set_title(f"no flight near the ground over {share:.0%} of it", fontsize=10)
        _kilometres(beneath)
        flat.append(beneath)
    colours = matplotlib.cm.ScalarMappable(norm, "plasma")
    figure.colorbar(colours, ax=flat, label=f"no flight up to, m above ground (PDOP ≥ {LIMIT.dop_limit:g})")
    return figure


def draw_flight(flown: Flight, grid: ElevationGrid) -> Figure:
    """Figure 10: the flight on the map and along the ground, satellites and PDOP along it."""
    figure = Figure(figsize=(9.6, 6.8), layout="constrained")
    order = [["map", "way"], ["map", "count"], ["map", "pdop"]]
    panels: dict[str, Axes] = figure.subplot_mosaic(order, width_ratios=[1.0, 1.9])
    _relief(panels["map"], grid)
    panels["map"].plot(flown.points_m[:, 0] / 1000.0, flown.points_m[:, 1] / 1000.0, color=FLIGHT_COLOUR, lw=1.8)
    start = flown.points_m[0, :2] / 1000.0
    panels["map"].plot(*start, "o", color=FLIGHT_COLOUR, ms=7)
    panels["map"].set_title(f"{flown.start:%Y-%m-%d}, from {flown.start:%H:%M} UTC", fontsize=10)
    minutes = flown.time_s / 60.0
    panels["way"].fill_between(minutes, flown.ground_m, flown.ground_m.min() - 20.0, color=GROUND, lw=0.0)
    panels["way"].plot(minutes, flown.points_m[:, 2], color=FLIGHT_COLOUR, lw=1.4)
    panels["way"].set_ylabel("altitude, m")
    for name, of_all, of_visible in (
        ("count", flown.total, flown.visible),
        ("pdop", flown.pdop_total, flown.pdop),
    ):
        panels[name].plot(minutes, of_all, color=FLIGHT_COLOUR, lw=1.6, label="all in the cone")
        panels[name].plot(minutes, of_visible, color=BLUE, lw=1.1, label="in sight")
    panels["count"].set_ylabel("satellites")
    panels["count"].yaxis.set_major_locator(MaxNLocator(integer=True))
    panels["count"].set_ylim(0.0, flown.total.max() + 1.5)
    panels["count"].legend(loc="lower left", fontsize=8, ncols=2)
    panels["pdop"].set_ylabel("PDOP")
    panels["pdop"].axhline(LIMIT.dop_limit, color=LIMIT_COLOUR, lw=1.0, ls="--")
    panels["pdop"].fill_between(
        minutes, 0.0, 1.0, where=list(flown.pdop >= LIMIT.dop_limit), color=LIMIT_COLOUR, alpha=0.13, lw=0.0,
        transform=panels["pdop"].get_xaxis_transform(),
    )  # fmt: skip
    panels["pdop"].set_xlabel("minutes of flight")
    for name in ("way", "count", "pdop"):
        panels[name].set_xlim(0.0, minutes[-1])
    return figure


def _title(shown: Scene) -> str:
    return f"{shown.when:%Y-%m-%d %H:%M} UTC, {len(shown.surfaces.anchors)} satellites"


def _colours(name: str, values: npt.NDArray[np.floating[Any]]) -> dict[str, Any]:
    """Colour map and norm: one colour for each count, or bands of PDOP."""
    if name == "pdop":
        map_ = matplotlib.colormaps["RdYlBu_r"]
        return {"cmap": map_, "norm": BoundaryNorm(PDOP_BOUNDS, map_.N, extend="max")}
    few, most = int(np.nanmin(values[values > 0], initial=np.inf)), int(np.nanmax(values))
    map_ = matplotlib.colormaps["viridis"]
    return {"cmap": map_, "norm": BoundaryNorm(np.arange(few, most + 2) - 0.5, map_.N)}


def _bar(figure: Figure, shades: Any, axes: Axes, name: str, label: str) -> None:
    bar = figure.colorbar(shades, ax=axes, label=label, pad=0.02, format="{x:g}")
    if name == "count":
        bar.set_ticks(
            [float(value) for value in np.arange(shades.norm.boundaries[0] + 0.5, shades.norm.boundaries[-1])]
        )
        bar.ax.minorticks_off()
        bar.ax.yaxis.set_major_formatter("{x:.0f}")


def _relief(axes: Axes, grid: ElevationGrid) -> None:
    shade = LIGHT.hillshade(grid.heights_m.astype(np.float64), dx=grid.cell_east_m, dy=grid.cell_north_m)
    axes.imshow(shade, cmap="gray", vmin=-0.35, vmax=1.0, extent=_extent_km(grid))
    _kilometres(axes)


def _kilometres(axes: Axes) -> None:
    axes.set_xlabel("east, km")
    axes.set_ylabel("north, km")
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.locator_params(nbins=5)


def _shaded(grid: ElevationGrid, surface_m: Any, above_m: Any, norm: Any) -> Array:
    """(rows, cols, 3): relief of a surface, grey where it is the ground, by height above ground elsewhere."""
    shade = LIGHT.hillshade(surface_m.astype(np.float64), dx=grid.cell_east_m, dy=grid.cell_north_m)
    colour = matplotlib.colormaps["plasma"](norm(above_m))[..., :3]
    colour[above_m <= 0.0] = 0.82
    few = np.round(shade[..., None] * SHADES) / SHADES
    lit: Array = np.clip(colour * (0.35 + 0.75 * few), 0.0, 1.0)
    return lit


def _axes_km(grid: ElevationGrid) -> tuple[Array, Array]:
    east_m = grid.origin_east_m + np.arange(grid.cols, dtype=np.float64) * grid.cell_east_m
    north_m = grid.origin_north_m - np.arange(grid.rows, dtype=np.float64) * grid.cell_north_m
    return east_m / 1000.0, north_m / 1000.0


def _extent_km(grid: ElevationGrid) -> tuple[float, float, float, float]:
    east_km, north_km = _axes_km(grid)
    half_east, half_north = grid.cell_east_m / 2000.0, grid.cell_north_m / 2000.0
    return (
        float(east_km[0] - half_east),
        float(east_km[-1] + half_east),
        float(north_km[-1] - half_north),
        float(north_km[0] + half_north),
    )


def _posts(
    grid: ElevationGrid, east_m: Array, north_m: Array
) -> tuple[npt.NDArray[np.floating[Any]], npt.NDArray[np.floating[Any]]]:
    return (grid.origin_north_m - north_m) / grid.cell_north_m, (east_m - grid.origin_east_m) / grid.cell_east_m
