"""One question, asked over HTTP, on the command line and in Python, has one answer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dem_samples
import visibility
from planning import paths, placement
from tests.service.running import Server

PLACES = {"D1": (645000.0, 5135500.0), "D2": (651000.0, 5135000.0), "D3": (648000.0, 5139500.0)}
HEIGHT_M = 400.0
ANCHORS = [
    {"id": name, "east_m": east_m, "north_m": north_m, "above_ground_m": HEIGHT_M}
    for name, (east_m, north_m) in PLACES.items()
]
ANCHOR_WORDS = [
    word for name, (east_m, north_m) in PLACES.items() for word in ("--anchor", f"{name},{east_m},{north_m},400agl")
]
START, GOAL = (647000.0, 5136200.0), (647600.0, 5136500.0)
# what tells of the asking, not of the answer
OF_THE_WAY = {"timing", "parameters", "files", "dem"}


@pytest.fixture(scope="module")
def valley(server: Server) -> dict[str, Any]:
    return server.sample("valley")


def over_http(server: Server, dem: dict[str, Any], resource: str, **asked: Any) -> dict[str, Any]:
    posted = server.client.post(f"/{resource}", json={"dem_id": dem["id"], **asked})
    assert posted.status_code in (200, 201, 202), posted.text
    done = server.until_over(posted.headers["Location"])
    assert done["status"] == "succeeded", done
    result: dict[str, Any] = done["result"]
    return result


def on_the_command_line(command: str, *words: Any) -> dict[str, Any]:
    line = [sys.executable, "-m", "service.cli", command, str(dem_samples.sample_path("valley")), *map(str, words)]
    # whatever the threads of the linear algebra are, the answer is the same
    told_threads = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([*line, "--json"], capture_output=True, text=True, timeout=300, check=False, env=told_threads)
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def assert_same(http: dict[str, Any], line: dict[str, Any]) -> None:
    assert set(http) - OF_THE_WAY == set(line) - OF_THE_WAY
    for name in set(http) - OF_THE_WAY:
        assert http[name] == line[name], name


def surfaces() -> visibility.MinimumVisibleAltitude:
    grid = dem_samples.load_sample("valley")
    anchors = [visibility.anchor_above_ground(grid, name, *place, HEIGHT_M) for name, place in PLACES.items()]
    return visibility.min_visible_altitude(grid, anchors)


def test_visibility(server: Server, valley: dict[str, Any]) -> None:
    http = over_http(server, valley, "visibility-maps", anchors=ANCHORS)
    assert_same(http, on_the_command_line("visibility", *ANCHOR_WORDS))
    visible = surfaces().visible(above_ground_m=1.5) == 1
    assert [one["visible_share"] for one in http["anchors"]] == pytest.approx(visible.mean(axis=(1, 2)).tolist())


def test_dilution(server: Server, valley: dict[str, Any]) -> None:
    http = over_http(server, valley, "dop-maps", anchors=ANCHORS, on_surface=True)
    assert_same(http, on_the_command_line("dop", *ANCHOR_WORDS, "--surface"))
    dop = visibility.dop_map(surfaces(), 1.5, on_surface=True).dop
    assert http["share_within_limit"] == pytest.approx(float(np.mean(dop < 2.5)))


def test_morphing_map(server: Server, valley: dict[str, Any]) -> None:
    http = over_http(server, valley, "morphing-maps", anchors=ANCHORS, ceiling_altitude_m=2500.0)
    told = on_the_command_line("morph", *ANCHOR_WORDS, "--ceiling", "2500msl")
    # the word is the command line's alone, and the sample does not say what its heights count from
    assert "given as msl" in told["warnings"].pop()
    assert_same(http, told)
    library = visibility.morphing_map(surfaces(), visibility.FlightLimit(2.5), ceiling_m=2500.0)
    _, posts = np.unique(library.state, return_counts=True)
    assert sorted(row["posts"] for row in http["states"] if row["posts"]) == sorted(posts.tolist())


# few candidates, so that the bound is proved on any machine, never cut short by the time that the exact step may take
def test_placement(server: Server, valley: dict[str, Any]) -> None:
    asked = {"count": 3, "candidates": [{"spacing_m": 3000.0, "above_ground_m": [120.0]}], "goal": {"min_anchors": 2}}
    http = over_http(server, valley, "placements", **asked)
    words = ("--count", 3, "--spacing", 3000, "--height", "120agl", "--min-anchors", 2)
    assert_same(http, on_the_command_line("place", *words))
    grid = dem_samples.load_sample("valley")
    found = placement.place_anchors(
        grid,
        placement.candidate_grid(grid, 3000.0, above_ground_m=[120.0]),
        placement.area_targets(grid, 1.5),
        3,
        placement.Goal(min_anchors=2),
    )
    assert http["value_m"] == found.value
    assert http["dilution"]["no_fix_share"] == placement.placement_geometry(grid, found).no_fix


def test_safety_bubbles(server: Server, valley: dict[str, Any], tmp_path: Path) -> None:
    points = [{"east_m": east_m, "north_m": north_m, "above_ground_m": 2.0} for east_m, north_m in (START, GOAL)]
    http = over_http(server, valley, "safety-bubbles", anchors=ANCHORS, points=points)
    table = tmp_path / "path.csv"
    table.write_text("".join(["east_m,north_m,above_ground_m\n", *(f"{e},{n},2.0\n" for e, n in (START, GOAL))]))
    assert_same(http, on_the_command_line("bubble", *ANCHOR_WORDS, "--path", table))


def test_path(server: Server, valley: dict[str, Any]) -> None:
    places = [dict(zip(("east_m", "north_m"), place, strict=True)) for place in (START, GOAL)]
    asked = {"start": places[0], "goals": places[1:], "rover": {"max_slope_deg": 40.0}, "budget": {"sampling": False}}
    http = over_http(server, valley, "paths", **asked)
    ends = ("--start", "{},{}".format(*START), "--goal", "{},{}".format(*GOAL))
    assert_same(http, on_the_command_line("plan", *ends, "--max-slope", 40, "--no-sampling"))
    grid = dem_samples.load_sample("valley")
    rover, budget = paths.RoverModel(max_slope_rad=np.radians(40.0)), paths.PlanBudget(sampling=False)
    planned = paths.plan_path(paths.PathProblem(grid, START, GOAL, rover=rover, budget=budget))
    assert http["totals"]["length_m"] == pytest.approx(planned.path.totals.length_m)
