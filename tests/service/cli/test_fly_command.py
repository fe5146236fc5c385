"""sightline fly, from words to files."""

import json

import pytest

from service.products.flights.files import LAYERS
from tests.service.cli.positioning_words import ANCHORS
from tests.service.small_maps import NORTH_M, WEST_M


def point(east_m, south_m, height):
    return f"{WEST_M + east_m},{NORTH_M - south_m},{height}"


FEW = ("--iterations", 2000)
ENDS = ("--start", point(100, 400, "60msl"), "--goal", point(750, 70, "40agl"), *FEW)
HIGH = ("--start", point(100, 400, "300msl"), "--goal", point(750, 70, "350msl"), *FEW)
ABOVE = (*ANCHORS, "--dop-limit", 500, "--ceiling", "400msl")


def test_a_flight_is_told_and_written(sightline, dem_file, tmp_path):
    ended = sightline(
        "fly",
        dem_file,
        *HIGH,
        *ABOVE,
        "--mode",
        "exact",
        "--bubble",
        15,
        "--vertical-datum",
        "EGM96",
        "--out",
        tmp_path,
    )
    assert ended.code == 0, ended.stderr
    assert "above the morphing map" in ended.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        ["flight.json", *(layer.name for layer in LAYERS)]
    )
    summary = json.loads((tmp_path / "flight.json").read_text())
    assert summary["status"] == "found"
    assert summary["parameters"]["morphing_map"]["dop_limit"] == 500.0


def test_no_flight_is_an_answer(sightline, dem_file, tmp_path):
    ended = sightline("fly", dem_file, *ENDS, "--ceiling", "70msl", "--out", tmp_path)
    assert ended.code == 0, ended.stderr
    assert "unreachable" in ended.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"flight.json", "flight.geojson", "map.png"}


def test_a_flight_is_planned_above_the_map_that_morph_wrote(sightline, dem_file, tmp_path):
    made = sightline("morph", dem_file, *ABOVE, "--out", tmp_path)
    assert made.code == 0, made.stderr
    ended = sightline("fly", dem_file, *HIGH, "--map", tmp_path / "morph.json", "--seed", 3, "--speed", 9, "--json")
    summary = ended.told()
    assert (summary["status"], summary["seed"]) == ("found", 3)
    assert summary["totals"]["margin_m"] is not None
    assert summary["totals"]["time_s"] == pytest.approx(summary["totals"]["length_m"] / 9.0)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "A flight needs --start and --goal, each EAST,NORTH,HEIGHT; or --request."),
        (
            ("--start", "1,2", "--goal", "1,2,3msl"),
            "--start '1,2' is not of the form EAST,NORTH,HEIGHT with HEIGHT like",
        ),
        ((*ENDS, *ANCHORS), "A morphing map of anchors needs --ceiling, the top of the air"),
        ((*ENDS, "--map", "missing.json"), "The map 'missing.json' cannot be read"),
        ((*ENDS, *ANCHORS, "--map", "missing.json"), "A map brings its own anchors along; give --map or anchors."),
        ((*ENDS, "--bubble", -1), "--bubble: Input should be greater than or equal to 0"),
        ((*ENDS, "--bubble", 70), "The start at 60.0 m is below the floor; it may be there from"),
    ],
)
def test_bad_input_ends_with_one_sentence_and_exit_code_2(sightline, dem_file, words, sentence):
    ended = sightline("fly", dem_file, *words)
    ended.refused(sentence)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[]", "The map given.json holds no JSON object."),
        ("not", "The map given.json is not JSON: "),
        ('{"version": "1"}', "The map given.json: it is no morph.json that Sightline wrote."),
        ('{"parameters": {}, "dop_quantiles": []}', "The map given.json: it is no morph.json that Sightline wrote."),
    ],
)
def test_a_file_that_is_no_morphing_map_is_refused(sightline, dem_file, tmp_path, text, sentence):
    (tmp_path / "given.json").write_text(text)
    ended = sightline("fly", dem_file, *ENDS, "--map", tmp_path / "given.json")
    assert ended.code == 2
    assert sentence in ended.stderr
