"""Previews of maps: the numbers of the library, by level, and nothing of them stays."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import psutil
import pytest

import dem_samples
from terrain import ElevationGrid, write_npz
from tests.service.running import Server
from visibility import Anchor, AntennaLimits, dop_map, min_visible_altitude, position_error_map
from visibility.sight import anchor_above_ground
from visibility.signal import RADIOS, margin_map, min_usable_altitude

PLACES = ((646500.0, 5136500.0), (649500.0, 5138500.0), (648000.0, 5135800.0), (647200.0, 5138200.0))
ANCHORS = [
    {"id": f"D{n}", "east_m": east_m, "north_m": north_m, "above_ground_m": 60.0}
    for n, (east_m, north_m) in enumerate(PLACES)
]


@pytest.fixture(scope="module")
def valley() -> ElevationGrid:
    return dem_samples.load_sample("valley")


@pytest.fixture(scope="module")
def dem_id(server: Server) -> str:
    return str(server.sample("valley")["id"])


def preview(server: Server, dem_id: str, **body: Any) -> tuple[dict[str, Any], npt.NDArray[np.float32]]:
    """What the first line tells, and the arrays after it."""
    answer = server.client.post("/previews", json={"dem_id": dem_id, "anchors": ANCHORS, **body})
    assert answer.status_code == 200, answer.text
    line, _, numbers = answer.content.partition(b"\n")
    told = json.loads(line)
    return told, np.frombuffer(numbers, "<f4").reshape(len(told["names"]), told["rows"], told["cols"])


def anchors_on(grid: ElevationGrid) -> list[Anchor]:
    return [anchor_above_ground(grid, f"D{n}", *place, 60.0) for n, place in enumerate(PLACES)]


def test_a_preview_of_sight_is_the_map_that_the_library_makes(
    server: Server, dem_id: str, valley: ElevationGrid
) -> None:
    told, altitude_m = preview(server, dem_id)
    found = min_visible_altitude(valley, anchors_on(valley))
    assert told["names"] == ["D0", "D1", "D2", "D3"]
    assert told["error_statement"] == found.error_statement
    assert altitude_m.tobytes() == found.altitude_m.tobytes()


@pytest.mark.parametrize("measure", ["hdop", "gdop"])
def test_dilution_and_error_are_those_of_the_library(
    server: Server, dem_id: str, valley: ElevationGrid, measure: str
) -> None:
    lines = min_visible_altitude(valley, anchors_on(valley))
    _, dop = preview(server, dem_id, show="dop", measure=measure, receiver_above_ground_m=3.0)
    np.testing.assert_array_equal(dop[0], dop_map(lines, 3.0, measure=measure).dop)  # type: ignore[arg-type] # a measure
    _, error_m = preview(server, dem_id, show="position_error", receiver_above_ground_m=3.0)
    np.testing.assert_array_equal(error_m[0], position_error_map(lines, 3.0).position_sigma_m)


def test_a_coarse_preview_is_of_the_level_s_ground(server: Server, dem_id: str, valley: ElevationGrid) -> None:
    level = server.client.get(f"/dems/{dem_id}/levels").json()["levels"][1]
    heights_m = np.frombuffer(server.client.get(level["href"]).content, "<f4").reshape(level["rows"], level["cols"])
    coarse = replace(
        valley,
        heights_m=heights_m,
        **{name: level[name] for name in ("cell_east_m", "cell_north_m", "origin_east_m", "origin_north_m")},
    )
    told, altitude_m = preview(server, dem_id, level=1)
    assert (told["rows"], told["cols"]) == heights_m.shape
    found = min_visible_altitude(coarse, anchors_on(valley)).altitude_m
    assert altitude_m.tobytes() == found.tobytes()
    _, needed_m = preview(server, dem_id, level=1, show="needed_height")
    np.testing.assert_allclose(needed_m, found - heights_m, atol=1e-3)


def coarse_of(server: Server, dem_id: str, valley: ElevationGrid, number: int) -> ElevationGrid:
    """The ground of a level."""
    level = server.client.get(f"/dems/{dem_id}/levels").json()["levels"][number]
    heights_m = np.frombuffer(server.client.get(level["href"]).content, "<f4").reshape(level["rows"], level["cols"])
    names = ("cell_east_m", "cell_north_m", "origin_east_m", "origin_north_m")
    return replace(valley, heights_m=heights_m, **{name: level[name] for name in names})


def heard(radio: str) -> list[dict[str, Any]]:
    return [{**anchor, "radio": radio} for anchor in ANCHORS]


def test_what_is_usable_and_its_dilution_and_error_are_those_of_the_library(
    server: Server, dem_id: str, valley: ElevationGrid
) -> None:
    coarse = coarse_of(server, dem_id, valley, 1)
    anchors = [replace(anchor, radio=RADIOS["uwb"]) for anchor in anchors_on(valley)]
    lines = min_usable_altitude(coarse, anchors)
    asked = {"anchors": heard("uwb"), "sight": "usable", "level": 1}
    told, needed_m = preview(server, dem_id, **asked, show="needed_height")
    assert told["names"] == ["D0", "D1", "D2", "D3"]
    np.testing.assert_allclose(needed_m, lines.altitude_m - coarse.heights_m, atol=1e-3)
    assert told["error_statement"].startswith("signals over every edge"), "no ray of fast mode decided"
    _, dop = preview(server, dem_id, **asked, show="dop", measure="hdop", receiver_above_ground_m=3.0)
    np.testing.assert_array_equal(dop[0], dop_map(lines, 3.0, measure="hdop").dop)
    _, error_m = preview(server, dem_id, **asked, show="position_error", receiver_above_ground_m=3.0)
    np.testing.assert_array_equal(error_m[0], position_error_map(lines, 3.0).position_sigma_m)
    _, seen_m = preview(server, dem_id, level=1, show="needed_height")
    assert not np.array_equal(needed_m, seen_m), "UWB ends where sight does not"


def test_margins_are_those_of_the_library_and_end_with_the_reach_of_an_antenna(
    server: Server, dem_id: str, valley: ElevationGrid
) -> None:
    coarse = coarse_of(server, dem_id, valley, 1)
    anchor = replace(anchors_on(valley)[0], radio=RADIOS["868MHz"])
    wanted, _ = margin_map(coarse, anchor, RADIOS["868MHz"], coarse.heights_m + np.float32(2.0))
    asked = {"sight": "usable", "level": 1, "show": "margin_db", "receiver_above_ground_m": 2.0}
    told, margin_db = preview(server, dem_id, **asked, anchors=heard("868MHz")[:1])
    assert (told["names"], told["mode"]) == (["D0"], "exact")
    np.testing.assert_array_equal(margin_db[0], wanted)
    _, limited = preview(server, dem_id, **asked, anchors=[{**heard("868MHz")[0], "max_range_m": 900.0}])
    east_m, north_m = coarse.position_of(*np.indices(coarse.shape))
    far = np.hypot(east_m - anchor.east_m, north_m - anchor.north_m) > 900.0
    assert np.isneginf(limited[0][far]).all()
    assert np.isfinite(limited[0][~far]).any()


def test_trees_weaken_what_is_usable_on_every_level(server: Server, dem_id: str) -> None:
    asked = {"anchors": heard("868MHz")[:1], "sight": "usable", "show": "margin_db"}
    for level in (1, 2):
        _, bare = preview(server, dem_id, **asked, level=level)
        _, wooded = preview(server, dem_id, **asked, level=level, cover={"canopy": {"top_m": 18.0}})
        known = np.isfinite(bare) & np.isfinite(wooded)
        assert (wooded[known] <= bare[known]).all()
        assert (wooded[known] < bare[known] - 1.0).mean() > 0.5


def test_the_radio_of_a_satellite_on_a_low_anchor_is_told(server: Server, dem_id: str) -> None:
    asked = {"sight": "usable", "level": 2}
    told, _ = preview(server, dem_id, **asked, anchors=heard("gnss-l1")[:1])
    assert any(note.startswith("Radio of D0: gnss-l1 is the budget of a satellite") for note in told["warnings"])
    told, _ = preview(server, dem_id, **asked, anchors=heard("868MHz")[:1])
    assert not any("satellite" in note for note in told["warnings"])


def test_a_low_anchor_under_coarse_ground_is_raised_with_it_and_told(server: Server, tmp_path: Path) -> None:
    heights_m = np.full((64, 64), 100.0, np.float32)
    heights_m[32, 32] = 60.0  # a hole that the coarser level has at 90 m
    write_npz(ElevationGrid(heights_m, 10.0, 10.0), tmp_path / "hole.npz")
    dem = server.upload(tmp_path / "hole.npz")
    bounds = dem["bounds_of_posts_m"]
    mast = {"id": "M", "east_m": bounds["west"] + 320.0, "north_m": bounds["north"] - 320.0, "above_ground_m": 2.0}
    told, altitude_m = preview(server, dem["id"], anchors=[mast], level=1)
    assert any(note.startswith("M is looked at ") for note in told["warnings"])
    assert np.isfinite(altitude_m).all()


def test_beyond_the_reach_of_an_antenna_nothing_is_in_sight(server: Server, dem_id: str, valley: ElevationGrid) -> None:
    limited = {**ANCHORS[0], "max_range_m": 900.0, "azimuth_from_deg": 20.0, "azimuth_to_deg": 140.0}
    _, altitude_m = preview(server, dem_id, anchors=[limited], receiver_above_ground_m=2.0)
    limits = AntennaLimits(max_range_m=900.0, azimuth_from_rad=np.radians(20.0), azimuth_to_rad=np.radians(140.0))
    anchor = replace(anchors_on(valley)[0], limits=limits)
    visible = min_visible_altitude(valley, [anchor]).visible(above_ground_m=2.0)
    np.testing.assert_array_equal(valley.heights_m + np.float32(2.0) >= altitude_m[0], visible[0] == 1)
    assert 0 < np.count_nonzero(visible[0]) < valley.heights_m.size / 2


def test_unknown_ground_stays_unknown(server: Server, tmp_path: Path) -> None:
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[10:20, 20:25] = np.nan
    write_npz(ElevationGrid(heights_m, 10.0, 10.0), tmp_path / "holes.npz")
    dem = server.upload(tmp_path / "holes.npz")
    bounds = dem["bounds_of_posts_m"]
    anchor = {"id": "A", "east_m": bounds["west"], "north_m": bounds["north"] - 150.0, "above_ground_m": 5.0}
    _, altitude_m = preview(server, dem["id"], anchors=[anchor])
    assert np.isnan(altitude_m[0, 15, 20:]).all()
    assert np.isfinite(altitude_m[0, 15, :20]).all()


def test_nothing_of_a_preview_stays(server: Server, dem_id: str) -> None:
    kept = sorted(path for path in server.folder.rglob("*") if path.is_file())
    for number in range(5):
        preview(server, dem_id, anchors=[{**ANCHORS[0], "above_ground_m": 50.0 + number}], show="needed_height")
    assert sorted(path for path in server.folder.rglob("*") if path.is_file()) == kept


def test_what_cannot_be_previewed_is_refused_in_one_sentence(server: Server, dem_id: str) -> None:
    def refused(status: int, **body: Any) -> str:
        answer = server.client.post("/previews", json={"dem_id": dem_id, "anchors": ANCHORS, **body})
        assert answer.status_code == status, answer.text
        return str(answer.json()["detail"])

    assert "coarser than the whole DEM" in refused(422, level=12)
    assert "anchor" in refused(422, anchors=[]).lower()
    assert "unique" in refused(422, anchors=[ANCHORS[0], ANCHORS[0]])
    assert "outside" in refused(422, anchors=[{**ANCHORS[0], "east_m": 1.0}]).lower()
    assert "show" in refused(422, show="everything")
    assert "usable" in refused(422, show="margin_db")
    assert "without a radio: D0, D1, D2, D3" in refused(422, sight="usable")
    assert "DEM" in refused(404, dem_id="0" * 32)


def test_a_preview_beyond_the_limit_is_refused_before_it_is_calculated(server: Server, tmp_path: Path) -> None:
    write_npz(ElevationGrid(np.zeros((1400, 1400), np.float32), 10.0, 10.0), tmp_path / "wide.npz")
    dem = server.upload(tmp_path / "wide.npz")
    anchors = [{"id": str(n), "east_m": 7_000.0, "north_m": -7_000.0, "altitude_m": 50.0 + n} for n in range(17)]
    answer = server.client.post("/previews", json={"dem_id": dem["id"], "anchors": anchors})
    assert answer.status_code == 422
    assert "33,320,000 numbers" in answer.json()["detail"]
    one = {"dem_id": dem["id"], "anchors": [{**anchors[0], "radio": "868MHz"}], "sight": "usable"}
    answer = server.client.post("/previews", json=one)
    assert answer.status_code == 422
    assert "usable over 1,960,000 posts takes too long" in answer.json()["detail"]


def test_hundreds_of_drags_leave_memory_and_disk_as_they_were(server: Server, dem_id: str) -> None:
    def drag(number: int) -> None:
        moved = {**ANCHORS[0], "east_m": 646000.0 + 5.0 * number}
        preview(server, dem_id, anchors=[moved, *ANCHORS[1:]], show="needed_height")

    def held() -> tuple[int, set[Path]]:
        processes = [psutil.Process(server.process.pid), *server.workers]
        return sum(one.memory_info().rss for one in processes), set(server.folder.rglob("*"))

    # a process that only starts grows by what it imports
    server.until("/health", lambda told: told["workers"]["warm"] == told["workers"]["wanted"])
    for number in range(100):
        drag(number)
    before_bytes, before_files = held()
    for number in range(100, 500):
        drag(number)
    after_bytes, after_files = held()
    # each map kept would be 300 kB of its own: 400 of them 120 MB
    assert after_bytes - before_bytes < 48_000_000
    assert after_files == before_files
