"""Real woods: GNSS below and above the trees of Davos, and a lidar survey read as rock and as canopy."""

from __future__ import annotations

import math
from pathlib import Path

import netCDF4
import numpy as np
import numpy.typing as npt
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from benchmarks.report import Row, Table
from terrain import ElevationGrid
from visibility import anchor_above_ground, min_visible_altitude
from visibility.cover import (
    canopy_between,
    density_loss,
    early_itu_loss,
    fit_density,
    p833_slant_loss,
    weissberger_loss,
)
from visibility.signal import RADIOS, Foliage, min_usable_altitude, with_foliage

__all__ = ["DAVOS", "davos_pairs", "fitted_to_davos", "surface_as_rock"]

Reals = npt.NDArray[np.float64]

DATA = Path(__file__).parents[2] / "../shared/data/canopy"
DAVOS = DATA / "gnssvod"
LIDAR = DATA / "lidr/Topography.laz"
L1_HZ = 1.57542e9
TREES_M = 25.0
LOWEST_DEG = 10.0
GROUND, WATER = 2, 9  # classes of LAS
RECEIVER_M = 1.5
ANCHOR_M = 40.0
CLEARING_M = 0.5

DAVOS_NOTE = """\
GPS L1 heard below and above a forest at once, 15 s apart for a day, from 10° up. Ways are 1/sin(elevation), and for the
published models 25 m of that. Those are of other forests, and of ways whose ends lie in the trees; what one density
leaves is single trees and gaps, of which it knows nothing."""

LIDAR_NOTE = """\
286 × 286 m of forest with a lake (lidR's example), posts 2 m apart: ground from the returns of ground and water,
surface from the highest return. Four anchors 40 m above the ground, receivers 1.5 m above it. *Rock*: the surface model
is taken for the ground, so that what is below it is hidden, also a receiver under trees. *Canopy*: surface less ground,
crowns down to the ground, Weissberger's loss. Shares are of posts and anchors together; a clearing has less than 0.5 m
of trees. What becomes usable is the radio's doing as much as the trees': UWB ends at some 30 m in the open."""


def davos_pairs() -> tuple[Reals, Reals, Reals]:
    """(seconds, loss dB, elevation rad) of GPS satellites heard below and above the forest at once, from 10° up.

    Of GPS alone, since all of it is on one carrier: the other systems' first signals are not.
    """
    with netCDF4.Dataset(next(DAVOS.glob("*.nc"))) as day:
        level_db = np.ma.filled(day["S1"][:].astype(float), np.nan)
        up_deg = np.ma.filled(day["Elevation"][:].astype(float), np.nan)
        stations, satellites = day["Station"][:].tolist(), day["SV"][:].tolist()
        second = np.broadcast_to(day["Epoch"][:][:, None], level_db.shape[1:])
    below, above = stations.index("Dav1_Grnd"), stations.index("Dav2_Twr")
    gps = np.array([name.startswith("G") for name in satellites])
    loss_db, elevation_rad = level_db[above] - level_db[below], np.radians(up_deg[above])
    known = np.isfinite(loss_db) & (up_deg[above] >= LOWEST_DEG) & gps
    return second[known], loss_db[known], elevation_rad[known]


def fitted_to_davos() -> Table:
    """A density fitted to half of the pairs on the other half, and published models on all."""
    columns = ("what", "pairs", "rms", "optical depth straight up")
    title = "Loss below the trees of Davos"
    if not DAVOS.is_dir():
        return Table(title, ("what",), (Row(("the data are not here",)),))
    second, loss_db, up_rad = davos_pairs()
    way, early = 1.0 / np.sin(up_rad), second < np.median(second)
    rows = []
    for what, fitted in (("first half, on the second", early), ("second half, on the first", ~early)):
        fit = fit_density(loss_db[fitted], way[fitted])
        left_db = _rms(loss_db[~fitted] - density_loss(way[~fitted], fit.depth_per_m))
        cells = (f"density fitted to the {what}", f"{np.count_nonzero(~fitted)}", f"{left_db:.2f} dB")
        depth = f"{fit.depth_per_m:.3f} ± {fit.sigma_per_m:.3f}"
        rows.append(Row((*cells, depth), "≤ 5.5 dB", left_db <= 5.5))
    way_m = TREES_M * way
    for name, found in (
        ("ITU-R P.833, slant", p833_slant_loss(way_m, L1_HZ, up_rad)),
        ("Weissberger", weissberger_loss(way_m, L1_HZ)),
        ("early ITU", early_itu_loss(way_m, L1_HZ)),
    ):
        rows.append(Row((f"{name}, as published", f"{len(loss_db)}", f"{_rms(loss_db - found.loss_db):.2f} dB", "")))
    return Table(title, columns, rows, DAVOS_NOTE)


def surface_as_rock(*, post_m: float = 2.0, radios: tuple[str, ...] = ("868MHz", "2.4GHz", "uwb")) -> Table:
    """Shares of posts that a surface model taken for ground hides, and that are usable through its canopy."""
    columns = ("radio", "posts", "hidden by rock", "of these usable", "in clearings, of these usable", "seen, unusable")
    title = "A surface model read as rock and as canopy"
    if not LIDAR.is_file():
        return Table(title, ("what",), (Row(("the data are not here",)),))
    ground, surface = _lidar_grids(post_m)
    canopy = canopy_between(ground, surface)
    wooded = with_foliage(ground, Foliage(canopy))
    quarters = [(ground.rows * row, ground.cols * col) for row in (0.25, 0.75) for col in (0.25, 0.75)]
    receiver_m = ground.heights_m + np.float32(RECEIVER_M)
    clearing = np.broadcast_to(canopy.top_m < CLEARING_M, (len(quarters), *ground.shape))
    rows = []
    for name in radios:
        anchors = [
            anchor_above_ground(ground, f"D{number}", *ground.position_of(*at), ANCHOR_M, radio=RADIOS[name])
            for number, at in enumerate(quarters, 1)
        ]
        seen = receiver_m >= min_visible_altitude(surface, anchors, "exact").altitude_m
        usable = receiver_m >= min_usable_altitude(wooded, anchors, "exact").altitude_m
        open_hidden = clearing & ~seen
        cells = (
            name, f"{seen.size}", _share(~seen, np.ones_like(seen)), _share(usable, ~seen),
            f"{_share(usable, open_hidden)} of {open_hidden.sum()}", _share(~usable, seen),
        )  # fmt: skip
        rows.append(Row(cells))
    return Table(title, columns, rows, LIDAR_NOTE)


def _share(of: npt.NDArray[np.bool_], among: npt.NDArray[np.bool_]) -> str:
    return f"{100.0 * float(of[among].mean()):.1f} %" if among.any() else "of none"


def _lidar_grids(post_m: float) -> tuple[ElevationGrid, ElevationGrid]:
    """(bare ground, surface) of the survey, over the same posts."""
    import laspy  # of the extra `bench`, which the product's users do not have

    survey = laspy.read(LIDAR)
    east_m, north_m, up_m = (np.asarray(survey[name], np.float64) for name in ("x", "y", "z"))
    west_m, south_m = math.ceil(east_m.min()), math.ceil(north_m.min())
    cols, rows = int((east_m.max() - west_m) // post_m) + 1, int((north_m.max() - south_m) // post_m) + 1
    top_m = south_m + (rows - 1) * post_m
    posts = np.meshgrid(west_m + post_m * np.arange(cols), top_m - post_m * np.arange(rows))
    low = np.isin(np.asarray(survey.classification), (GROUND, WATER))
    places = np.column_stack([east_m, north_m])
    ground_m = LinearNDInterpolator(places[low], up_m[low])(*posts)
    beyond = np.isnan(ground_m)
    ground_m[beyond] = NearestNDInterpolator(places[low], up_m[low])(*(at[beyond] for at in posts))
    surface_m = np.full((rows, cols), -np.inf)
    row = np.rint((top_m - north_m) / post_m).astype(np.intp)
    col = np.rint((east_m - west_m) / post_m).astype(np.intp)
    on = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
    np.maximum.at(surface_m, (row[on], col[on]), up_m[on])
    highest_m = np.maximum(surface_m, ground_m)  # a post without a return is ground

    def grid(heights_m: Reals) -> ElevationGrid:
        return ElevationGrid(heights_m.astype(np.float32), post_m, post_m, float(west_m), float(top_m))

    return grid(ground_m), grid(highest_m)


def _rms(values: Reals) -> float:
    return float(np.sqrt((values**2).mean()))
