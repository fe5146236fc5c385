"""``--buildings`` and ``--canopy`` of every command that reads a DEM, and what is usable under them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from terrain import write_npz
from tests.service.small_maps import small_grid
from tests.service.small_paths import at
from tests.service.test_cover_of_products import footprints


@pytest.fixture
def files(tmp_path):
    dem, town = tmp_path / "small.npz", tmp_path / "town.geojson"
    write_npz(small_grid(), dem)
    town.write_text(json.dumps(footprints()))
    return str(dem), str(town)


def ends():
    places = ((at(95.0, 229.0), 5), (at(330.0, 229.0), 2))
    start, end = (f"{place['east_m']},{place['north_m']},{height}agl" for place, height in places)
    return ["--from", start, "--to", end, "--json"]


def test_a_line_through_a_building_is_blocked_by_it(sightline, files):
    dem, town = files
    assert json.loads(sightline("los", dem, *ends()).stdout)["verdict"] == "clear"
    told = json.loads(sightline("los", dem, *ends(), "--buildings", town).stdout)
    assert (told["verdict"], told["blocked_by"]) == ("blocked", "building")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--buildings", "none.geojson"], "cannot be read"),
        (["--level-height", "3"], "need --buildings FILE"),
        (["--building-origin", "1,2"], "--building-origin needs --buildings FILE"),
        (["--buildings", "TOWN", "--building-origin", "1,2"], "go with a mesh, not with footprints"),
        (["--buildings", "DEM"], "neither GeoJSON of footprints nor a mesh format"),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(sightline, files, options, sentence):
    dem, town = files
    given = [{"TOWN": town, "DEM": dem}.get(word, word) for word in options]
    sightline("los", dem, *ends(), *given).refused(sentence)


@pytest.mark.parametrize("command", [["visibility"], ["dop"], ["morph", "--dop-limit", "30", "--ceiling", "300agl"]])
def test_maps_tell_what_stands_there(sightline, files, command):
    dem, town = files
    anchors = [
        word
        for number, place in enumerate((at(95.0, 305.0), at(400.0, 30.0), at(420.0, 430.0), at(750.0, 90.0)))
        for word in ("--anchor", f"A{number},{place['east_m']},{place['north_m']},60agl")
    ]
    bare, built = (
        sightline(command[0], dem, *anchors, *command[1:], *more, "--json") for more in ([], ["--buildings", town])
    )
    assert (bare.code, built.code) == (0, 0), built.stderr
    told = [json.loads(answer.stdout) for answer in (bare, built)]
    for answer in told:
        for name in ("elapsed_s", "timing", "parameters", "warnings", "version", "dem"):
            answer.pop(name, None)
    assert told[0] != told[1]


def test_maps_of_sites_refuse_buildings(sightline, files):
    dem, town = files
    sightline("sites", dem, "--buildings", town).refused("knows bare ground only; leave out --buildings")


def test_footprints_without_heights_are_refused_by_the_names_of_options(sightline, files, tmp_path):
    dem, _ = files
    town = footprints()
    del town["features"][0]["properties"]["height"]
    (tmp_path / "flat.geojson").write_text(json.dumps(town))
    told = sightline("los", dem, *ends(), "--buildings", str(tmp_path / "flat.geojson"))
    told.refused("--buildings: 1 of 4 footprints", "the first is way/0", "(--level-height)", "(--default-height)")


@pytest.mark.parametrize("command", ["plan", "fly"])
def test_a_map_of_a_file_that_knew_other_buildings_is_told(sightline, files, tmp_path, command):
    dem, town = files
    anchors = [
        word
        for number, place in enumerate((at(95.0, 305.0), at(400.0, 30.0), at(420.0, 430.0), at(750.0, 90.0)))
        for word in ("--anchor", f"A{number},{place['east_m']},{place['north_m']},60agl")
    ]
    of_air = ["--dop-limit", "30", "--ceiling", "300agl"]
    kind, limits, summary = (
        ("morph", of_air, "morph.json") if command == "fly" else ("visibility", [], "visibility.json")
    )
    sightline(kind, dem, *anchors, *limits, "--buildings", town, "--out", str(tmp_path / "map"))
    height = ",150agl" if command == "fly" else ""
    start, goal = (f"{place['east_m']},{place['north_m']}{height}" for place in (at(330.0, 329.0), at(430.0, 329.0)))
    asked = [
        command,
        dem,
        f"--start={start}",
        f"--goal={goal}",
        "--map",
        str(tmp_path / "map" / summary),
        "--json",
    ]
    bare, built = (json.loads(sightline(*asked, *more).stdout)["warnings"] for more in ([], ["--buildings", town]))
    assert [sentence for sentence in bare if "made of other ground" in sentence]
    assert not [sentence for sentence in built if "made of other ground" in sentence]


TREES = ["--canopy-height", "18", "--canopy-density", "0.05"]
ANCHOR = ["--anchor", "A,{east_m},{north_m},60agl".format(**at(95.0, 305.0))]


def test_a_map_of_what_is_usable_knows_radios_and_trees(sightline, files, tmp_path):
    dem, _ = files
    usable = ["--sight", "usable", "--radio", "868MHz"]
    shares = []
    for number, more in enumerate(([], usable, [*usable, *TREES])):
        out = tmp_path / str(number)
        told = json.loads(sightline("visibility", dem, *ANCHOR, *more, "--json", "--out", str(out)).stdout)
        shares.append(told["anchors"][0]["visible_share"])
        assert (out / "margin_db.tif").exists() == ("--sight" in more)
    assert shares[1] > shares[0]
    assert shares[2] < shares[1]


def test_a_canopy_in_a_file_weakens_as_one_height_does(sightline, files, tmp_path):
    dem, _ = files
    grid = small_grid()
    write_npz(replace(grid, heights_m=np.full(grid.shape, 18.0, np.float32)), tmp_path / "trees.npz")
    usable = ["--sight", "usable", "--radio", "868MHz", "--json", "--canopy-density", "0.05"]
    one, file = (
        json.loads(sightline("visibility", dem, *ANCHOR, *usable, *trees).stdout)["anchors"]
        for trees in (["--canopy-height", "18"], ["--canopy", str(tmp_path / "trees.npz")])
    )
    assert one == file


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--radio", "uwb"], "--radio goes with --sight usable"),
        (["--sight", "usable"], "not known without a radio: A"),
        (["--canopy-density", "0.1"], "Trees need --canopy FILE"),
        (["--canopy", "none.tif"], "cannot be read"),
        (["--canopy-height", "9", "--canopy-model", "density"], "belongs to the model density"),
    ],
)
def test_radios_and_trees_that_make_no_question_are_refused(sightline, files, options, sentence):
    sightline("visibility", files[0], *ANCHOR, *options).refused(sentence)


def test_another_file_of_buildings_is_told_all_that_are_known(sightline, files):
    sightline("los", files[0], *ends(), "--buildings", "town.kml").refused(".geojson", ".stl", ".glb")


def test_plans_placements_and_moves_may_be_of_what_is_usable(sightline, files, tmp_path):
    dem, _ = files
    usable = ["--sight", "usable", "--radio", "868MHz", "--json"]
    place = [
        "place",
        dem,
        *ANCHOR,
        "--spacing",
        "200",
        "--height",
        "30agl",
        "--count",
        "1",
        "--objective",
        "coverage",
        "--min-anchors",
        "1",
    ]
    start, goal = ("{east_m},{north_m}".format(**one) for one in (at(45.0, 430.0), at(470.0, 70.0)))
    plan = ["plan", dem, *ANCHOR, "--start", start, "--goal", goal, "--no-sampling"]
    link = ["--base", "{east_m},{north_m},2agl".format(**at(60.0, 300.0)), "--link-radio", "915MHz"]
    placed = sightline(*place, *usable, *link).told()
    assert placed["parameters"]["radio"]["preset"] == "868MHz"
    assert placed["parameters"]["rules"]["link"]["radio"]["preset"] == "915MHz"
    blind = sightline(*place, "--json").told()
    assert placed["exact_share"] > blind["exact_share"]
    heard = sightline(*plan, *usable).told()
    assert heard["parameters"]["sight"] == "usable"
    assert heard["totals"]["fewest_anchors"] == 1
    sightline(*plan, "--radio", "uwb").refused("--radio goes with --sight usable")
    sightline(*place, "--link-radio", "uwb").refused("--link-range, --link-radio and --relays need --base")
    sightline(*place, "--sight", "usable").refused("not known without a radio")


def test_cover_that_cannot_stand_is_refused_resampled_or_told(sightline, files, tmp_path):
    dem, _ = files
    crossing = footprints()
    ring = crossing["features"][0]["geometry"]["coordinates"][0]
    crossing["features"][0]["geometry"]["coordinates"][0] = [ring[0], ring[2], ring[1], ring[3], ring[0]]
    (tmp_path / "bow.geojson").write_text(json.dumps(crossing))
    sightline("info", dem, "--buildings", str(tmp_path / "bow.geojson")).refused("is no simple polygon")
    grid = small_grid()
    below = replace(grid, heights_m=np.full(grid.shape, -1.0, np.float32))
    write_npz(below, tmp_path / "below.npz")
    sightline("info", dem, "--canopy", str(tmp_path / "below.npz")).refused("must be heights >= 0 m")
    away = replace(grid, origin_east_m=grid.origin_east_m + 50_000.0, heights_m=np.ones(grid.shape, np.float32))
    write_npz(away, tmp_path / "away.npz")
    sightline("info", dem, "--canopy", str(tmp_path / "away.npz")).refused("The canopy lies nowhere on the ground")
    outside = footprints()
    for feature in outside["features"]:
        ring = feature["geometry"]["coordinates"][0]
        feature["geometry"]["coordinates"][0] = [[east + 0.2, north] for east, north in ring]
    (tmp_path / "outside.geojson").write_text(json.dumps(outside))
    sightline("info", dem, "--buildings", str(tmp_path / "outside.geojson")).refused("known ground under its middle")
    coarse = replace(grid, heights_m=np.full((13, 16), 7.0, np.float32), cell_east_m=60.0, cell_north_m=40.0)
    write_npz(coarse, tmp_path / "coarse.npz")
    told = sightline("info", dem, "--canopy", str(tmp_path / "coarse.npz"), "--json").told()
    assert any("was resampled to the DEM's" in one for one in told["warnings"])
    assert told["cover"]["canopy"]["mean_top_m"] == pytest.approx(7.0)
    write_npz(replace(grid, heights_m=np.full(grid.shape, 0.04, np.float32)), tmp_path / "dense.npz")
    dense = ["--canopy-height", "9", "--canopy-densities", str(tmp_path / "dense.npz")]
    low = ["--canopy-bases", str(tmp_path / "coarse.npz")]
    trees = sightline("info", dem, *dense, *low, "--json").told()["cover"]["canopy"]
    assert (trees["model"], trees["mean_base_m"]) == ("density", pytest.approx(7.0))
    assert trees["mean_density_per_m"] == pytest.approx(0.04)
    sightline("info", dem, *low).refused("Trees need --canopy FILE")
    uwb = ["--sight", "usable", "--radio", "uwb", "--canopy-height", "9", "--canopy-model", "p833_woodland"]
    answer = sightline("visibility", dem, *ANCHOR, *uwb, "--json").told()
    (note,) = (one for one in answer["warnings"] if "nothing is told" in one)
    assert note == "ITU-R P.833 for woodland is for 105.9 to 2117.5 MHz; nothing is told at 6489.6 MHz."
