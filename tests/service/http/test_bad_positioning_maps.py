"""DOP maps and morphing maps that are refused over HTTP, each in one sentence, before a job exists."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.http.test_bad_requests import NORTH_M, WEST_M, assert_problem
from tests.service.http.test_positioning_maps import ANCHORS, CEILING, SKY
from tests.service.running import Server
from tests.service.skies import TIME, almanac

ONE_LINE = [
    {"id": f"L{n}", "east_m": WEST_M + 9000.0 + 1000.0 * n, "north_m": NORTH_M - 9000.0, "altitude_m": 2500.0}
    for n in range(4)
]
TRACK = {"id": "T", "points": [{**{k: v for k, v in ANCHORS[0].items() if k != "id"}, "time_s": 0.0}]}
BAD: dict[str, tuple[str, dict[str, Any], str, str]] = {
    "nothing to range to": ("/dop-maps", {}, "validation", "Give anchors or satellites"),
    "too few anchors": ("/dop-maps", {"anchors": ANCHORS[:2]}, "visibility-input", "at least 3 anchors; 2 are given"),
    "one anchor along the surface": (
        "/dop-maps",
        {"anchors": ANCHORS[:1], "on_surface": True},
        "visibility-input",
        "at least 2 anchors; 1 is given",
    ),
    "anchors on one line": ("/dop-maps", {"anchors": ONE_LINE}, "visibility-input", "stand on one line"),
    "a limit of 0": ("/dop-maps", {"anchors": ANCHORS, "dop_limit": 0}, "validation", "dop_limit"),
    "a limit below 0": ("/morphing-maps", {"anchors": ANCHORS, "dop_limit": -1, **CEILING}, "validation", "dop_limit"),
    "a clock's dilution without a clock": (
        "/dop-maps",
        {"anchors": ANCHORS, "measure": "tdop"},
        "validation",
        "'tdop' needs kind 'pseudorange'",
    ),
    "one dilution per set along the surface": (
        "/dop-maps",
        {"anchors": ANCHORS, "on_surface": True, "one_dop_per_set": True},
        "validation",
        "A visible set has no one slope",
    ),
    "an anchor without any error": (
        "/dop-maps",
        {"anchors": [{**ANCHORS[0], "ranging_sigma_m": 0.0}, *ANCHORS[1:]]},
        "visibility-input",
        "would weigh infinitely much",
    ),
    "a path off the map": (
        "/dop-maps",
        {"anchors": ANCHORS, "path": [{"east_m": 0.0, "north_m": 0.0, "above_ground_m": 2.0}]},
        "visibility-input",
        "path[0] lies outside the DEM",
    ),
    "a volume of too many voxels": (
        "/dop-maps",
        {"anchors": ANCHORS, "volume": {"ceiling_above_ground_m": 500.0, "layer_m": 0.5}},
        "limit",
        "146,641,495 voxels, more than the limit of 100,000,000",
    ),
    "too many layers": (
        "/dop-maps",
        {"anchors": ANCHORS, "volume": {"ceiling_above_ground_m": 500.0, "layer_m": 0.001}},
        "visibility-input",
        "500,001 layers every 0.001 m are more than the limit",
    ),
    "a volume below the ground": (
        "/dop-maps",
        {"anchors": ANCHORS, "volume": {"ceiling_altitude_m": -900.0}},
        "visibility-input",
        "is below the ground, which begins at",
    ),
    "a cut off the map": (
        "/dop-maps",
        {"anchors": ANCHORS, "cuts": [{"line": [{"east_m": 0.0, "north_m": 0.0}, {"east_m": 9.0, "north_m": 0.0}]}]},
        "visibility-input",
        "cuts[0] leaves the volume",
    ),
    "a cut that is two": (
        "/dop-maps",
        {"anchors": ANCHORS, "cuts": [{"altitude_m": 1.0, "above_ground_m": 1.0}]},
        "validation",
        "exactly one of line, altitude_m and above_ground_m",
    ),
    "a volume along the surface": (
        "/dop-maps",
        {"anchors": ANCHORS, "on_surface": True, "volume": CEILING},
        "validation",
        "Air has no slope",
    ),
    "a time outside a track": (
        "/morphing-maps",
        {"anchors": ANCHORS, "tracks": [TRACK], "frames": {"to_s": 60.0, "step_s": 30.0}, **CEILING},
        "visibility-input",
        "runs from 0 s to 0 s",
    ),
    "a track without frames": (
        "/morphing-maps",
        {"anchors": ANCHORS, "tracks": [TRACK], **CEILING},
        "validation",
        "Anchors on tracks need frames",
    ),
    "frames beyond the calendar": (
        "/morphing-maps",
        {"satellites": {**SKY, "time": "9999-12-31T23:59:59Z"}, "frames": {"to_s": 60.0, "step_s": 30.0}, **CEILING},
        "visibility-input",
        "lies beyond the calendar",
    ),
    "an almanac that ends before the frames": (
        "/morphing-maps",
        {"satellites": SKY, "frames": {"to_s": 1e8, "step_s": 1e8}, "kind": "pseudorange", **CEILING},
        "almanac",
        "days before",
    ),
    "two sources of orbits": (
        "/dop-maps",
        {"satellites": {**SKY, "navigation": "x"}},
        "validation",
        "exactly one of almanac and navigation",
    ),
    "a navigation file that is none": (
        "/dop-maps",
        {"satellites": {"navigation": "x", "time": TIME}},
        "almanac-file",
        "navigation file",
    ),
    "an almanac with a missing field": (
        "/dop-maps",
        {"satellites": {**SKY, "almanac": almanac().replace("30\n0\n", "30\n")}},
        "almanac-file",
        "almanac",
    ),
    "no ceiling": ("/morphing-maps", {"anchors": ANCHORS}, "validation", "exactly one of ceiling_altitude_m"),
    "two ceilings": (
        "/morphing-maps",
        {"anchors": ANCHORS, "ceiling_altitude_m": 900.0, **CEILING},
        "validation",
        "both were given",
    ),
    "a ceiling below the ground": (
        "/morphing-maps",
        {"anchors": ANCHORS, "ceiling_altitude_m": -900.0},
        "visibility-input",
        "is below the ground, which begins at",
    ),
    "an almanac of another week": (
        "/dop-maps",
        {"satellites": {**SKY, "time": "2026-11-22T00:00:00Z"}},
        "almanac",
        "days before",
    ),
    "an almanac without reference": (
        "/dop-maps",
        {"satellites": {"almanac": SKY["almanac"], "time": TIME}},
        "almanac",
        "modulo 1024",
    ),
    "a truncated almanac": (
        "/morphing-maps",
        {"satellites": {**SKY, "almanac": almanac()[:1500]}, **CEILING},
        "almanac-file",
        "almanac",
    ),
    "unhealthy satellites only": (
        "/dop-maps",
        {"satellites": {**SKY, "almanac": almanac(6, unhealthy=6)}},
        "almanac",
        "All 6 satellites",
    ),
    "a time without offset": (
        "/dop-maps",
        {"satellites": {**SKY, "time": "2007-01-27T06:00:00"}},
        "validation",
        "satellites.time",
    ),
    "an almanac without end": (
        "/dop-maps",
        {"satellites": {**SKY, "almanac": "x" * 200_001}},
        "validation",
        "satellites.almanac",
    ),
    "1000 anchors": ("/dop-maps", {"anchors": [{**ANCHORS[0], "id": f"A{i}"} for i in range(1000)]}, "limit", "64"),
    "an anchor called as a satellite": (
        "/dop-maps",
        {"anchors": [{**ANCHORS[0], "id": f"G{n:02d}"} for n in range(1, 25)], "satellites": SKY},
        "anchor",
        "unique",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_positioning_map_is_refused_before_a_job_exists(server: Server, jacksboro: dict[str, Any], what: str) -> None:
    path, request, kind, word = BAD[what]
    before = server.client.get(path).json()["total"]
    answer = server.client.post(path, json={"dem_id": jacksboro["id"], **request})
    assert_problem(answer, 422, kind, word)
    assert server.client.get(path).json()["total"] == before
