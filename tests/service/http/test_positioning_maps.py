"""DOP maps and morphing maps over HTTP: a resource each, layers to download, and problems in one sentence."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import rasterio
from PIL import Image

from tests.service.http.test_bad_requests import EAST_M, NORTH_M, SOUTH_M, WEST_M, assert_problem
from tests.service.running import Server
from tests.service.skies import REFERENCE_DATE, TIME, almanac
from tests.visibility.satellites.constellation import shared_file
from visibility import UNKNOWN
from visibility.dilution import GO, NO_GO

PLACES = {"A": (0.3, 0.3), "B": (0.7, 0.35), "C": (0.5, 0.75), "D": (0.45, 0.5)}
ANCHORS = [
    {
        "id": name,
        "east_m": WEST_M + x * (EAST_M - WEST_M),
        "north_m": SOUTH_M + y * (NORTH_M - SOUTH_M),
        "above_ground_m": 400.0,
    }
    for name, (x, y) in PLACES.items()
]
SKY = {"almanac": almanac(), "time": TIME, "reference_date": REFERENCE_DATE}
CEILING = {"ceiling_above_ground_m": 500.0}


def made(server: Server, path: str, /, **request: Any) -> dict[str, Any]:
    answer = server.client.post(path, json=request, headers={"Prefer": "wait=60"}, timeout=120.0)
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def bands(server: Server, map_: dict[str, Any], name: str) -> Any:
    content = server.client.get(f"{map_['links']['self']}/layers/{name}").raise_for_status().content
    with rasterio.MemoryFile(content) as file, file.open() as dataset:
        return dataset.read()


@pytest.fixture(scope="module")
def dop(server: Server, jacksboro: dict[str, Any]) -> dict[str, Any]:
    return made(server, "/dop-maps", dem_id=jacksboro["id"], anchors=ANCHORS, dop_limit=3.0, on_surface=True)


@pytest.fixture(scope="module")
def morphing(server: Server, jacksboro: dict[str, Any]) -> dict[str, Any]:
    return made(server, "/morphing-maps", dem_id=jacksboro["id"], anchors=ANCHORS, dop_limit=6.0, **CEILING)


def test_a_dop_map_says_what_its_layers_hold(server: Server, dop: dict[str, Any]) -> None:
    result = dop["result"]
    no_go = bands(server, dop, "no_go.tif")[0]
    known = result["dem"]["rows"] * result["dem"]["cols"] - result["dem"]["unknown_posts"]
    assert result["share_within_limit"] == pytest.approx(np.count_nonzero(no_go == GO) / known)
    assert result["share_no_go"] == pytest.approx(np.count_nonzero(no_go == NO_GO) / known)
    values = bands(server, dop, "dop.tif")[0]
    assert np.array_equal(np.isnan(values), no_go == UNKNOWN)
    assert (values[no_go == GO] < 3.0).all()
    assert (values[no_go == NO_GO] >= 3.0).all()


def test_a_morphing_map_lies_between_ground_and_ceiling(server: Server, morphing: dict[str, Any]) -> None:
    above_m = bands(server, morphing, "above_ground.tif")[0]
    state, intervals = bands(server, morphing, "flags.tif")
    flyable = np.isfinite(above_m)
    assert flyable.any()
    assert np.array_equal(flyable, (state == 1) | (state == 2))
    assert ((above_m[flyable] >= 0.0) & (above_m[flyable] <= 500.0)).all()
    assert (intervals[state == 1] == 0).all()
    shares = {row["state"]: row["posts"] for row in morphing["result"]["states"]}
    assert shares["above"] == np.count_nonzero(state == 2)


def test_satellites_come_with_the_request_and_orbits_stay_out_of_the_result(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    map_ = made(server, "/dop-maps", dem_id=jacksboro["id"], satellites=SKY, kind="pseudorange")
    assert len(map_["result"]["satellites"]) >= 4
    assert "almanac" not in map_["request"]["satellites"]
    assert "almanac" not in map_["result"]["parameters"]["satellites"]


def test_a_navigation_file_is_the_precise_source(server: Server, jacksboro: dict[str, Any]) -> None:
    sky = {"navigation": shared_file("rtklib_brdc0910.09n").read_text(), "time": "2009-04-01T12:00:00Z"}
    map_ = made(server, "/dop-maps", dem_id=jacksboro["id"], satellites=sky, kind="pseudorange", measure="tdop")
    assert len(map_["result"]["satellites"]) >= 4
    assert "navigation" not in map_["request"]["satellites"]
    # an almanac would do weeks later, ephemerides do not
    late = {"dem_id": jacksboro["id"], "satellites": {**sky, "time": "2009-04-03T12:00:00Z"}}
    assert_problem(server.client.post("/dop-maps", json=late), 422, "almanac", "ephemer")


def test_a_path_gets_a_table_and_a_map_without_path_has_none(
    server: Server, jacksboro: dict[str, Any], dop: dict[str, Any]
) -> None:
    path = [{name: ANCHORS[0][name] for name in ("east_m", "north_m")} | {"above_ground_m": h} for h in (2.0, 80.0)]
    map_ = made(server, "/dop-maps", dem_id=jacksboro["id"], anchors=ANCHORS, path=path)
    table = server.client.get(f"{map_['links']['self']}/layers/path.csv").raise_for_status().text.splitlines()
    assert len(table) == 3
    assert "path.csv" not in {layer["name"] for layer in dop["layers"]}
    assert server.client.get(f"{dop['links']['self']}/layers/path.csv").status_code == 404


def test_a_volume_and_its_cuts_are_layers_of_a_dop_map(
    server: Server, jacksboro: dict[str, Any], dop: dict[str, Any]
) -> None:
    line = [{name: ANCHORS[n][name] for name in ("east_m", "north_m")} for n in (0, 2)]
    map_ = made(
        server,
        "/dop-maps",
        dem_id=jacksboro["id"],
        anchors=ANCHORS,
        volume={"ceiling_above_ground_m": 300.0, "layer_m": 100.0},
        cuts=[{"line": line}, {"altitude_m": 700.0}],
    )
    assert map_["result"]["volume"]["layers"] == 4
    names = {layer["name"] for layer in map_["layers"]}
    air = {"cut-1.png", "cut-2.png", "volume_dop.tif", "volume_count.tif", "volume.npz", "volume.nc"}
    assert air <= names
    assert "cut-3.png" not in names
    assert not {name for name in air if name in {layer["name"] for layer in dop["layers"]}}
    assert server.client.get(f"{map_['links']['self']}/layers/cut-3.png").status_code == 404
    for name in air:
        answer = server.client.get(f"{map_['links']['self']}/layers/{name}")
        assert answer.status_code == 200, (name, answer.text)
    above_m = {n: bands(server, map_, "volume_dop.tif")[n] for n in (0, 3)}
    ground = bands(server, made(server, "/dop-maps", dem_id=jacksboro["id"], anchors=ANCHORS,
                                receiver_above_ground_m=300.0), "dop.tif")[0]  # fmt: skip
    assert np.array_equal(above_m[3], ground, equal_nan=True)
    assert not np.array_equal(above_m[0], ground, equal_nan=True)


def test_a_morphing_map_over_time_has_frames_and_an_animation(
    server: Server, jacksboro: dict[str, Any], morphing: dict[str, Any]
) -> None:
    points = [{"time_s": 60.0 * n, **{k: v for k, v in ANCHORS[n].items() if k != "id"}} for n in (1, 2)]
    map_ = made(
        server,
        "/morphing-maps",
        dem_id=jacksboro["id"],
        anchors=[ANCHORS[0], ANCHORS[3]],
        tracks=[{"id": "T", "points": points}],
        satellites={**SKY, "time": "2007-01-27T06:00:00+00:00"},
        kind="pseudorange",
        frames={"from_s": 60.0, "to_s": 120.0, "step_s": 30.0, "above_ground_m": 50.0},
        **CEILING,
    )
    told = map_["result"]["over_time"]
    assert [frame["time"] for frame in told["frames"]] == [
        f"2007-01-27T06:{time}+00:00" for time in ("01:00", "01:30", "02:00")
    ]
    assert {frame["anchors"] for frame in told["frames"]} == {3}
    assert bands(server, map_, "frames_altitude.tif").shape[0] == 3
    first_s, last_s, _, _, share, _ = bands(server, map_, "availability.tif")
    assert np.array_equal(np.isnan(first_s), share == 0.0)
    assert (first_s[share == 1.0] == 60.0).all()
    assert (last_s[share == 1.0] == 120.0).all()
    content = server.client.get(f"{map_['links']['self']}/layers/animation.gif").raise_for_status()
    assert content.headers["Content-Type"] == "image/gif"
    with Image.open(io.BytesIO(content.content)) as animation:
        assert animation.n_frames == 3
    for name in ("frames_state.tif", "availability.png", "map.png", "no_go.geojson"):
        assert server.client.get(f"{map_['links']['self']}/layers/{name}").status_code == 200, name
    assert not {"animation.gif", "availability.tif"} & {layer["name"] for layer in morphing["layers"]}
