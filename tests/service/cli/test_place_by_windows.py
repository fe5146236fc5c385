"""sightline place --windows: what the library answers, over a DEM that stays in its file."""

from __future__ import annotations

import csv
import json
import math

import pytest
import rasterio

from planning.placement import Goal, PlacementRules, WindowQuestion, candidate_grid, place_by_windows
from terrain import open_dem
from terrain.synthetic import fractal

LATTICE = ("--spacing", 300, "--height", "50agl", "--max-range", 900)
COVERAGE = ("--objective", "coverage", "--min-anchors", 1)


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    path = tmp_path_factory.mktemp("dem") / "large.tif"
    grid = fractal(96, 3, relief_m=300.0, cell_m=30.0)
    at = rasterio.Affine(30.0, 0.0, 600_000.0, 0.0, -30.0, 5_000_000.0)
    size = {"height": grid.rows, "width": grid.cols, "count": 1, "dtype": "float32", "nodata": math.nan}
    with rasterio.open(path, "w", driver="GTiff", crs="EPSG:32632", transform=at, **size) as file:
        file.write(grid.heights_m, 1)
    return path


def test_the_command_answers_what_the_library_answers(sightline, large, tmp_path):
    out = tmp_path / "out"
    told = sightline("place", large, "--windows", "--count", 3, *LATTICE, *COVERAGE, "--out", out, "--json").told()
    dem = open_dem(large)
    question = WindowQuestion(Goal("coverage", min_anchors=1), PlacementRules(max_range_m=900.0))
    expected = place_by_windows(dem, candidate_grid(dem, 300.0, above_ground_m=[50.0]), 3, question)
    shares = ("value", "bound", "exact", "greedy", "before")
    assert [told[f"{name}_share"] for name in shares] == [
        getattr(expected, {"greedy": "greedy_value"}.get(name, name)) for name in shares
    ]
    places = [(anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in expected.anchors]
    assert [(one["east_m"], one["north_m"], one["altitude_m"]) for one in told["placed"]] == places
    assert told["targets"]["points"] == 96 * 96
    assert told["dem"]["rows"] == 96
    assert sorted(path.name for path in out.iterdir()) == ["anchors.csv", "anchors.geojson", "place.json"]
    with (out / "anchors.csv").open(newline="") as file:
        assert [float(row["max_range_m"]) for row in csv.DictReader(file)] == [900.0] * 3
    assert json.loads((out / "place.json").read_text())["value_share"] == expected.value


def test_placed_anchors_are_seen_by_windows_over_as_much_ground(sightline, large, tmp_path):
    out = tmp_path / "out"
    told = sightline("place", large, "--windows", "--count", 1, *LATTICE, *COVERAGE, "--out", out, "--json").told()
    anchors = out / "anchors.csv"
    seen = sightline(
        "visibility", large, "--windows", "--anchors", anchors, "--receiver-height", 1.5, "--mode", "exact", "--json"
    ).told()
    assert seen["anchors"][0]["visible_posts"] == round(told["exact_share"] * 96 * 96)


def test_standing_anchors_count(sightline, large):
    told = sightline(
        "place", large, "--windows", "--count", 2, *LATTICE, *COVERAGE, "--anchor", "F,601400,4998700,60agl", "--json"
    ).told()
    assert told["before_share"] > 0.0
    assert [one["id"] for one in told["fixed"]] == ["F"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--max-range", 900), ('not for "mean_error"',)),
        (COVERAGE, ("by windows it needs one",)),
        ((*COVERAGE, "--max-range", 900, "--seed", 3), ("a seed (nothing is drawn)",)),
        ((*COVERAGE, "--max-range", 900, "--base", "601400,4998700,10agl"), ("a link to a base",)),
        ((*COVERAGE, "--max-range", 900, "--terrain-frame"), ("--terrain-frame",)),
        ((*COVERAGE, "--max-range", 900, "--margin", 100), ("--margin is for a DEM that is held",)),
        ((*COVERAGE, "--max-range", 900, "--or-local"), ("--or-local goes with --scheduler",)),
    ],
)
def test_what_is_not_looked_at_is_refused(sightline, large, options, words):
    lattice = ("--spacing", 300, "--height", "50agl")
    sightline("place", large, "--windows", "--count", 2, *lattice, *options).refused(*words)


def test_a_share_to_reach_is_refused(sightline, large):
    sightline("place", large, "--windows", "--reach", 0.5, *LATTICE, *COVERAGE).refused("a share to reach")


def test_a_dem_that_is_too_large_to_be_held_is_placed_on_by_windows(sightline, large, monkeypatch):
    import service.cli.asking.options as options
    from terrain import DemTooLargeError

    def too_large(*_, **__):
        raise DemTooLargeError("too large", cells=96 * 96, limit_cells=10)

    monkeypatch.setattr(options.Reading, "read", too_large)
    told = sightline("place", large, "--count", 1, *LATTICE, *COVERAGE, "--json").told()
    assert any("more than are read whole" in warning for warning in told["warnings"])
    assert told["value_share"] > 0.0
