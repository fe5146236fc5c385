"""What errors in metres stand on is told beside them, and --range-sigma says it: errors are in proportion to it."""

import json

import pytest
import rasterio

from tests.service.cli.positioning_words import ANCHORS
from tests.service.small_maps import NORTH_M, WEST_M

OWN = "0.1 m to anchors"
DOP = ("dop", *ANCHORS)
BUBBLE = ("bubble", *ANCHORS, "--path", "way.csv", "--under-ground", "violated")
PLAN = (
    *("plan", *ANCHORS, "--start", f"{WEST_M + 120},{NORTH_M - 420}", "--goal", f"{WEST_M + 300},{NORTH_M - 420}"),
    *("--max-slope", 60, "--no-sampling"),
)


@pytest.fixture
def asked(sightline, dem_file, tmp_path, monkeypatch):
    """The answer of a command line as JSON, or as a person reads it, on one line."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "way.csv").write_text(
        "east_m,north_m,above_ground_m,time_s\n"
        f"{WEST_M + 120},{NORTH_M - 420},30,0\n{WEST_M + 300},{NORTH_M - 420},30,20\n"
    )

    def run(command, *words, read=False):
        ended = sightline(command[0], dem_file, *command[1:], *words, *(() if read else ("--json",)))
        assert ended.code == 0, ended.stderr
        return " ".join(ended.stdout.replace("│", " ").split()) if read else json.loads(ended.stdout)

    return run


@pytest.mark.parametrize("command", [DOP, BUBBLE, PLAN], ids=lambda command: command[0])
def test_the_sigma_of_a_range_is_told(asked, command):
    assert asked(command)["sigmas"] == OWN
    assert asked(command, "--range-sigma", 0.25)["sigmas"] == "0.25 m to anchors"
    assert f"one sigma of a range {OWN}" in asked(command, read=True)


def test_errors_are_in_proportion_to_it(asked):
    once, five_times = (asked(DOP, "--range-sigma", sigma_m)["position_error_quantiles_m"] for sigma_m in (0.1, 0.5))
    assert asked(DOP)["position_error_quantiles_m"] == once
    for name, quantiles_m in once.items():
        assert quantiles_m["p05"] is not None
        assert five_times[name]["p05"] == pytest.approx(5.0 * quantiles_m["p05"], rel=1e-5)


def test_the_raster_of_errors_carries_it(asked, tmp_path):
    asked(DOP, "--range-sigma", 0.25, "--out", tmp_path / "out")
    with rasterio.open(tmp_path / "out" / "position_error.tif") as dataset:
        assert "0.25 m to anchors" in dataset.tags().values()


def test_anchors_of_several_kinds_and_poses_are_told_apart(asked, tmp_path):
    rows = ["id,east_m,north_m,above_ground_m,ranging_sigma_m,pose_sigma_m"]
    rows += [f"A{n},{WEST_M + 200 * n},{NORTH_M - 100 - 90 * (n % 2)},80,{0.2 * n},{0.5 * n - 0.5}" for n in (1, 2, 3)]
    (tmp_path / "drones.csv").write_text("\n".join(rows))
    told = asked(("dop", "--anchors", "drones.csv"))["sigmas"]
    assert told == "0.2 to 0.6 m to anchors, anchors' places 0 to 1 m per axis"


def test_a_placement_for_errors_takes_it(asked):
    place = (
        *("place", "--count", 3, "--spacing", 200, "--height", "60agl"),
        *("--objective", "mean-error", "--range-sigma"),
    )
    once, half = asked((*place, 0.01)), asked((*place, 0.005))
    assert "ranging with a sigma of 0.005 m" in half["goal"]
    assert half["placed"] is not None
    assert half["value_m"] < once["value_m"]


def test_a_map_brings_its_own(sightline, dem_file, asked, tmp_path):
    asked(DOP, "--out", tmp_path / "map")
    words = (*PLAN[len(ANCHORS) + 1 :], "--map", tmp_path / "map" / "dop.json", "--range-sigma", 0.5)
    ended = sightline("plan", dem_file, *words)
    assert (ended.code, ended.stdout) == (2, "")
    assert "give --map or --range-sigma" in ended.stderr


@pytest.mark.parametrize("wrong", ["-1", "nan", "much"])
@pytest.mark.parametrize("command", [DOP, PLAN], ids=lambda command: command[0])
def test_what_is_no_sigma_is_refused(sightline, dem_file, command, wrong):
    ended = sightline(command[0], dem_file, *command[1:], "--range-sigma", wrong)
    assert (ended.code, ended.stdout) == (2, "")
    assert ended.stderr.count("\n") == 1
