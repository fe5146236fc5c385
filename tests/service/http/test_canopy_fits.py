"""A canopy fitted over HTTP: the density behind a log, with its error, and used by a map; what cannot be fitted."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from benchmarks.visibility.woods import DAVOS
from service.files.canopy_fits import fit_of_log
from service.files.canopy_logs import read_canopy_log
from service.products.registry import PRODUCTS
from terrain import ElevationGrid, write_npz
from tests.service.cli.test_canopy_command import BASE_M, DEPTH, TOP_M, rows, sky_log
from tests.service.http.test_bad_requests import assert_problem
from tests.service.http.test_every_product import posted
from tests.service.running import Server
from visibility.cover import Canopy
from visibility.signal import RADIOS, Foliage, signals, with_foliage

MAP = PRODUCTS["visibility-map"]
EVEN = {"canopy": {"top_m": TOP_M, "base_m": BASE_M}}


def log_of(path: Path | str) -> dict[str, str]:
    return {"name": Path(path).name, "base64": base64.b64encode(Path(path).read_bytes()).decode()}


def asked(server: Server, **body: Any) -> httpx.Response:
    return server.client.post("/canopy-fits", json=body)


def fitted(server: Server, **body: Any) -> dict[str, Any]:
    answer = asked(server, **body)
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def test_the_density_behind_a_log_is_that_of_the_command_and_a_map_uses_it(
    server: Server, ground: dict[str, Any], tmp_path: Path
) -> None:
    log = sky_log(tmp_path / "log.csv", noise_db=2.0)
    told = fitted(server, log=log_of(log), cover=EVEN)
    assert abs(told["depth_per_m"] - DEPTH) < 3.0 * told["sigma_per_m"] < 0.1 * DEPTH
    of_command = fit_of_log(read_canopy_log(Path(log)), None, crowns_m=(BASE_M, TOP_M), min_elevation_deg=10.0)
    assert told == of_command.model_dump(mode="json")
    made = posted(server, MAP, ground, cover={"canopy": told["canopy"]})
    assert made.status_code == 201, made.text
    trees = made.json()["result"]["dem"]["cover"]["canopy"]
    assert (trees["model"], trees["mean_top_m"]) == ("density", TOP_M)
    assert trees["depth_per_m"] == pytest.approx(told["depth_per_m"])
    straight_up = fitted(server, log=log_of(log))
    assert straight_up["canopy"] is None
    assert "The height of the trees is not known" in straight_up["warnings"][0]


def test_powers_at_places_tell_the_density_of_trees_on_a_dem(server: Server, tmp_path: Path) -> None:
    heights_m = np.add.outer(np.zeros(40), 0.3 * np.arange(60)).astype(np.float32)
    grid = ElevationGrid(heights_m, 10.0, 10.0, 1000.0, 5000.0)
    write_npz(grid, tmp_path / "slope.npz")
    dem = server.upload(tmp_path / "slope.npz")
    top_m = np.full(grid.shape, TOP_M, np.float32)
    wooded = with_foliage(grid, Foliage(Canopy(grid, top_m, np.zeros_like(top_m)), "density", DEPTH))
    random = np.random.default_rng(3)
    east_m, north_m = random.uniform(1050.0, 1550.0, 40), random.uniform(4650.0, 4950.0, 40)
    places_m = np.column_stack([east_m, north_m, 0.03 * (east_m - 1000.0) + 2.0])
    sent_m = np.broadcast_to((1300.0, 4800.0, 60.0), places_m.shape)
    power_dbm = signals(wooded, sent_m, places_m, RADIOS["868MHz"]).received_dbm
    values = [("D1", *place, power) for place, power in zip(places_m.tolist(), power_dbm.tolist(), strict=True)]
    log = log_of(rows(tmp_path / "log.csv", "anchor_id,east_m,north_m,altitude_m,power_dbm", values))
    anchors = [{"id": "D1", "east_m": 1300.0, "north_m": 4800.0, "altitude_m": 60.0, "radio": "868MHz"}]
    on_dem = {"log": log, "dem_id": dem["id"], "cover": {"canopy": {"top_m": TOP_M}}, "anchors": anchors}
    told = fitted(server, **on_dem)
    assert told["depth_per_m"] == pytest.approx(DEPTH, rel=1e-6)
    assert (told["count"], told["sources"]) == (40, 1)
    assert told["canopy"] == {"top_m": TOP_M, "base_m": 0.0, "model": "density", "depth_per_m": told["depth_per_m"]}
    nobody = asked(server, **{**on_dem, "dem_id": "0" * 32})
    assert_problem(nobody, 404, "not-found", "DEM")
    treeless = asked(server, **{**on_dem, "cover": None})
    assert_problem(treeless, 422, "request", "Which trees stand on the DEM is not told")
    silent = asked(server, **{**on_dem, "anchors": [{**anchors[0], "radio": None}]})
    assert_problem(silent, 422, "cover", "What anchor D1 sends is not known without a radio")
    others = asked(server, **{**on_dem, "anchors": [{**anchors[0], "id": "D2"}]})
    assert_problem(others, 422, "request", "heard D1, not among the anchors")


def test_what_of_a_log_is_not_used_is_told(server: Server, tmp_path: Path) -> None:
    names = "elevation_deg,loss_db,power_dbm,lon_deg,lat_deg"
    values = [(5.0 + 10.0 * n, 3.0, -90.0, 11.0, 46.0) for n in range(5)]
    told = fitted(server, log=log_of(rows(tmp_path / "log.csv", names, values)), cover=EVEN, min_elevation_deg=20.0)
    assert told["count"] == 3
    assert "Of satellites lower than 20° losses count as not known: 2." in told["warnings"]
    unread = "Columns of the log that are not used: beside loss_db power_dbm; without a DEM lon_deg, lat_deg."
    assert unread in told["warnings"]


@pytest.mark.skipif(not DAVOS.is_dir(), reason="the log of Davos lies in ../shared/data")
def test_davos_is_fitted_by_direction_out_of_its_netcdf(server: Server) -> None:
    stations = {"below": "Dav1_Grnd", "above": "Dav2_Twr"}
    even = {"cover": {"canopy": {"top_m": 25.0}}, "receiver_above_ground_m": 0.0}
    told = fitted(server, log=log_of(next(DAVOS.glob("*.nc"))), sectors=12, **stations, **even)
    assert (told["count"], told["canopy"]["sky"]["elevation_edges_deg"]) == (5783, [10.0, 30.0, 50.0, 90.0])
    assert told["sky_held_out_rms_db"] <= told["held_out_rms_db"] <= 5.5


@pytest.mark.parametrize(
    ("names", "row", "more", "kind", "sentence"),
    [
        ("satellite,elevation_deg", "G1,40", {}, "request", "needs loss_db, cn0_dbhz with cn0_open_dbhz, or power_dbm"),
        ("loss_db", "4", {}, "request", "has no column elevation_deg"),
        ("loss_db,elevation_deg,wind", "4,40,2", {}, "request", "unknown column 'wind'"),
        ("loss_db,elevation_deg", "4,40", {}, "cover", "at least two losses"),
        ("loss_db,elevation_deg", "4,40", {"sectors": 4, "rings_deg": [50, 10]}, "cover", "two losses"),
        ("loss_db,elevation_deg", "4,40", {"rings_deg": [10, 50]}, "validation", "rings_deg needs sectors"),
        ("loss_db,elevation_deg", "4,40", {"sectors": -1}, "validation", "sectors"),
        ("loss_db,elevation_deg", "4,40", {"below": "A"}, "request", "below and above go with a NetCDF"),
        ("power_dbm,anchor_id,east_m,north_m", "-80,D1,0,0", {}, "request", "the ground and the anchors"),
        (
            *("loss_db,elevation_deg", "4,40", {"cover": {"canopy": {"top_m": 1.0}}}),
            *("request", "are not above a receiver at 1.5 m"),
        ),
        (
            *("loss_db,elevation_deg", "4,40", {"cover": {"canopy": {"top_m": 9.0, "season": 0.5}}}),
            *("validation", "What trees cost is what is fitted"),
        ),
        (
            *("loss_db,elevation_deg", "4,40", {"cover": {"footprints": {"geojson": {}}}}),
            *("validation", "Without a dem_id only a canopy of top_m and base_m counts"),
        ),
        (
            "loss_db,elevation_deg",
            "4,40",
            {"anchors": [{"id": "A", "east_m": 0.0, "north_m": 0.0, "altitude_m": 9.0}]},
            "request",
            "Anchors go with a log of power_dbm",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused_in_a_sentence(
    server: Server, tmp_path: Path, names: str, row: str, more: dict[str, Any], kind: str, sentence: str
) -> None:
    log = log_of(rows(tmp_path / "log.csv", names, [row.split(",")]))
    assert_problem(asked(server, log=log, **more), 422, kind, sentence)


def test_a_file_that_is_no_log_is_refused_and_named(server: Server) -> None:
    stations = {"below": "a", "above": "b"}
    damaged = {"name": "day.nc", "base64": base64.b64encode(b"CDF\x01garbage").decode()}
    assert_problem(asked(server, log=damaged, **stations), 422, "request", "The log day.nc")
    assert_problem(asked(server, log=damaged), 422, "request", "tell the stations")
    assert_problem(asked(server, log={"name": "a.csv", "base64": "abc"}), 422, "validation", "base64")
