"""``sightline canopy fit``: a density out of a log, with its error, used by other commands; what cannot be fitted."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.visibility.woods import DAVOS
from terrain import ElevationGrid, write_npz
from visibility.cover import Canopy
from visibility.signal import RADIOS, Foliage, fit_canopy, signals, with_foliage
from visibility.signal.calibration import HeardThrough

DB = 10.0 / math.log(10.0)
DEPTH, TOP_M, BASE_M = 0.031, 22.0, 4.0


def rows(path: Path, names: str, values: Any) -> str:
    path.write_text("\n".join([names, *(",".join(map(str, row)) for row in values)]) + "\n")
    return str(path)


def sky_log(path: Path, depth: float = DEPTH, noise_db: float = 0.0) -> str:
    """C/N0 of eight satellites through even trees, as the law of an exponential has it."""
    random = np.random.default_rng(5)
    values = []
    for number in range(8):
        for up_deg in random.uniform(12.0, 88.0, 30):
            way_m = (TOP_M - BASE_M) / math.sin(math.radians(up_deg))
            lost_db = DB * depth * way_m + random.normal(0.0, noise_db)
            values.append((f"G{number}", 45.0 * number + 5.0, up_deg, 48.0, 48.0 - lost_db))
    return rows(path, "satellite,azimuth_deg,elevation_deg,cn0_open_dbhz,cn0_dbhz", values)


def test_the_density_behind_a_log_is_found_and_used(sightline: Any, tmp_path: Path) -> None:
    log = sky_log(tmp_path / "log.csv", noise_db=2.0)
    crowns = ["--canopy-height", str(TOP_M), "--canopy-base", str(BASE_M)]
    told = sightline("canopy", "fit", log, *crowns, "--json", "--out", str(tmp_path / "fit")).told()
    assert told == json.loads((tmp_path / "fit/canopy.json").read_text())
    assert (told["count"], told["sources"]) == (240, 8)
    assert abs(told["depth_per_m"] - DEPTH) < 3.0 * told["sigma_per_m"] < 0.1 * DEPTH
    assert told["rms_db"] == pytest.approx(2.0, rel=0.15)
    assert told["canopy"] == {"top_m": TOP_M, "base_m": BASE_M, "model": "density", "depth_per_m": told["depth_per_m"]}
    ground = tmp_path / "level.npz"
    write_npz(ElevationGrid(np.zeros((9, 9), np.float32), 10.0, 10.0), ground)
    fitted = str(tmp_path / "fit/canopy.json")
    info = sightline("info", str(ground), "--canopy-fit", fitted, "--json").told()
    trees = info["cover"]["canopy"]
    assert (trees["share"], trees["mean_top_m"], trees["mean_base_m"], trees["model"]) == (
        1.0,
        TOP_M,
        BASE_M,
        "density",
    )
    assert trees["depth_per_m"] == pytest.approx(told["depth_per_m"])
    assert info["cover"]["buildings"] is None
    shown = sightline("info", str(ground), "--canopy-height", "9").stdout
    assert "on 100.0 % of the posts, 0.0 to 9.0 m" in shown
    assert "nothing that is known" in sightline("info", str(ground)).stdout


def test_heights_beside_those_of_a_fit_hold_and_are_told(sightline: Any, tmp_path: Path) -> None:
    ground = ElevationGrid(np.zeros((9, 9), np.float32), 10.0, 10.0)
    write_npz(ground, tmp_path / "level.npz")
    write_npz(replace(ground, heights_m=np.full((9, 9), 7.0, np.float32)), tmp_path / "crowns.npz")
    crowns = ["--canopy-height", str(TOP_M), "--canopy-base", str(BASE_M)]
    sightline("canopy", "fit", sky_log(tmp_path / "log.csv"), *crowns, "--out", str(tmp_path / "fit"))
    info = ["info", str(tmp_path / "level.npz"), "--canopy-fit", str(tmp_path / "fit/canopy.json"), "--json"]

    def known(*more: str) -> tuple[float, float, list[str]]:
        told = sightline(*info, *more).told()
        trees = told["cover"]["canopy"]
        assert trees["depth_per_m"] == pytest.approx(DEPTH, rel=1e-6), "the density is that of the fit"
        return trees["mean_top_m"], trees["mean_base_m"], [one for one in told["warnings"] if "The fit" in one]

    assert known() == (TOP_M, BASE_M, [])
    assert known("--canopy-height", str(TOP_M)) == (TOP_M, BASE_M, [])
    higher = "The fit canopy.json is of trees of 22 m; --canopy-height 30 m holds, with its density."
    assert known("--canopy-height", "30") == (30.0, BASE_M, [higher])
    lower = "The fit canopy.json is of crowns from 4 m; --canopy-base 2 m holds, with its density."
    assert known("--canopy-base", "2") == (TOP_M, 2.0, [lower])
    raster = "The fit canopy.json is of trees of 22 m; those of crowns.npz hold, with its density."
    assert known("--canopy", str(tmp_path / "crowns.npz")) == (7.0, BASE_M, [raster])


def test_by_direction_each_sector_has_its_own_density(sightline: Any, tmp_path: Path) -> None:
    values = []
    for number, depth in enumerate((0.01, 0.02, 0.03, 0.05)):
        for up_deg in np.linspace(15.0, 85.0, 30):
            lost_db = DB * depth * TOP_M / math.sin(math.radians(up_deg))
            values.append((f"E{number}", 90.0 * number + 40.0, up_deg, lost_db))
    log = rows(tmp_path / "log.csv", "satellite,azimuth_deg,elevation_deg,loss_db", values)
    asked = ["--canopy-height", str(TOP_M), "--receiver-height", "0", "--sectors", "4", "--rings", "10,90"]
    told = sightline("canopy", "fit", log, *asked, "--json").told()
    np.testing.assert_allclose(told["canopy"]["sky"]["depth_per_m"], [[0.01, 0.02, 0.03, 0.05]], rtol=1e-6)
    assert told["canopy"]["sky"]["elevation_edges_deg"] == [10.0, 90.0]
    assert told["sky_counts"] == [[30, 30, 30, 30]]
    assert told["sky_rms_db"] < 1e-6 < told["rms_db"]
    assert told["warnings"] == []
    finer = sightline("canopy", "fit", log, *asked[:-4], "--sectors", "8", "--rings", "10,90", "--json").told()
    assert finer["warnings"] == [
        "4 of 8 cells of the map by direction have fewer than 20 losses, and the density of all."
    ]


def test_powers_at_places_tell_the_density_of_trees_on_a_dem(sightline: Any, tmp_path: Path) -> None:
    heights_m = np.add.outer(np.zeros(40), 0.3 * np.arange(60)).astype(np.float32)
    grid = ElevationGrid(heights_m, 10.0, 10.0, 1000.0, 5000.0)
    top_m = np.full(grid.shape, TOP_M, np.float32)
    wooded = with_foliage(grid, Foliage(Canopy(grid, top_m, np.zeros_like(top_m)), "density", DEPTH))
    random = np.random.default_rng(3)
    east_m, north_m = random.uniform(1050.0, 1550.0, 40), random.uniform(4650.0, 4950.0, 40)
    places_m = np.column_stack([east_m, north_m, 0.03 * (east_m - 1000.0) + 2.0])
    anchor_m = np.broadcast_to((1300.0, 4800.0, 60.0), places_m.shape)
    power_dbm = signals(wooded, anchor_m, places_m, RADIOS["868MHz"]).received_dbm
    values = [("D1", *place, power) for place, power in zip(places_m.tolist(), power_dbm.tolist(), strict=True)]
    log = rows(tmp_path / "log.csv", "anchor_id,east_m,north_m,altitude_m,power_dbm", values)
    write_npz(grid, tmp_path / "slope.npz")
    asked = ["--dem", str(tmp_path / "slope.npz"), "--canopy-height", str(TOP_M), "--anchor", "D1,1300,4800,60msl"]
    told = sightline("canopy", "fit", log, *asked, "--radio", "868MHz", "--json").told()
    assert told["depth_per_m"] == pytest.approx(DEPTH, rel=1e-6)
    assert told["rms_db"] < 1e-6


def test_the_error_counts_losses_of_one_source_as_alike() -> None:
    # four satellites, each off by its own amount: a thousand pairs of each know no more than one
    random = np.random.default_rng(8)
    up_rad = random.uniform(0.3, 1.5, 4000)
    group = np.repeat(np.arange(4), 1000)
    way = 1.0 / np.sin(up_rad)
    loss_db = DB * 0.7 * way + np.array([-3.0, -1.0, 1.0, 3.0])[group]
    heard = HeardThrough(loss_db, way, np.zeros(4000), up_rad)
    together, alone = fit_canopy(heard, group), fit_canopy(heard)
    assert together.depth_per_m == alone.depth_per_m
    assert together.sigma_per_m > 10.0 * alone.sigma_per_m


@pytest.mark.skipif(not DAVOS.is_dir(), reason="the log of Davos lies in ../shared/data")
def test_davos_is_explained_by_a_density_on_the_half_it_was_not_fitted_to(sightline: Any) -> None:
    day = next(DAVOS.glob("*.nc"))
    asked = ["--below", "Dav1_Grnd", "--above", "Dav2_Twr", "--canopy-height", "25", "--receiver-height", "0"]
    told = sightline("canopy", "fit", str(day), *asked, "--sectors", "12", "--json").told()
    assert told["count"] == 5783
    assert told["held_out_rms_db"] <= 5.5
    assert told["sky_held_out_rms_db"] <= told["held_out_rms_db"]
    published = told["published_rms_db"]
    assert [round(published[name], 1) for name in ("ITU-R P.833, slant", "Weissberger", "early ITU")] == [
        8.5,
        9.0,
        12.4,
    ]


@pytest.mark.parametrize(
    ("names", "row", "more", "sentence"),
    [
        ("satellite,elevation_deg", "G1,40", [], "needs loss_db, cn0_dbhz with cn0_open_dbhz, or power_dbm"),
        ("loss_db", "4", [], "has no column elevation_deg"),
        ("loss_db,elevation_deg,wind", "4,40,2", [], "unknown column 'wind'"),
        ("loss_db,elevation_deg", "four,40", [], "not a number"),
        ("loss_db,elevation_deg", "1e300,40", [], "loss_db must lie within ±1,000, not 1e+300"),
        ("cn0_dbhz,cn0_open_dbhz,elevation_deg", "-1e308,1e308,40", [], "cn0_dbhz must lie within ±1,000"),
        ("loss_db,elevation_deg", "4,95", [], "elevation_deg must lie within ±90, not 95"),
        ("loss_db,elevation_deg", "4,40", [], "at least two losses"),
        ("loss_db,elevation_deg", "4,40", ["--canopy-height", "1"], "are not above a receiver at 1.5 m"),
        ("power_dbm,anchor_id,east_m,north_m", "-80,D1,0,0", [], "the ground and the anchors with their radio"),
        ("loss_db,elevation_deg", "4,40", ["--sectors", "4", "--rings", "ten"], "--rings takes ascending degrees"),
        ("loss_db,elevation_deg", "4,40", ["--sectors", "-1"], "needs both rings and sectors"),
        (
            "loss_db,elevation_deg",
            "4,40",
            ["--receiver-height", "nan"],
            "Invalid value for '--receiver-height': 'nan' is no number",
        ),
        ("loss_db,elevation_deg", "4,40", ["--below", "A"], "go with a .nc of gnssvod"),
        ("loss_db,elevation_deg", "4,40", ["--rings", "10,50"], "--rings needs --sectors N"),
        ("loss_db,elevation_deg", "4,40", ["--radio", "uwb"], "go with a log of power_dbm"),
        ("loss_db,elevation_deg", "4,40", ["--canopy-density", "0.1"], "What trees cost is what is fitted"),
        ("loss_db,elevation_deg", "4,40", ["--canopy", "a.tif"], "only --canopy-height and --canopy-base count"),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_a_sentence(
    sightline: Any, tmp_path: Path, names: str, row: str, more: list[str], sentence: str
) -> None:
    log = rows(tmp_path / "log.csv", names, [row.split(",")])
    sightline("canopy", "fit", log, *more).refused(sentence)


def test_a_map_by_direction_needs_directions_and_a_file_of_pairs_its_names(sightline: Any, tmp_path: Path) -> None:
    log = rows(tmp_path / "log.csv", "satellite,elevation_deg,loss_db", [("G1", 30, 5), ("G2", 40, 4)])
    sightline("canopy", "fit", log, "--canopy-height", "20", "--sectors", "4").refused("the azimuth of every loss")
    (tmp_path / "log.nc").write_bytes(b"CDF\x01garbage")
    pairs = ["--below", "a", "--above", "b"]
    sightline("canopy", "fit", str(tmp_path / "log.nc"), *pairs).refused("is not as gnssvod would write it: Station")
