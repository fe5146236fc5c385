"""The command line tells options where a request has fields, and heights as people type them."""

import re
from typing import get_args

import pytest

from service.cli.app import COMMANDS, command_line
from service.cli.asking import spoken as module
from service.cli.asking.spoken import spoken
from tests.service.small_maps import NORTH_M, WEST_M

ALTITUDE = "give its altitude (612msl) instead of its height above ground (80agl)"
SAID = [
    ("dop", "dop_limit: Input should be greater than 0.", "--dop-limit: Input should be greater than 0."),
    (
        "dop",
        "Air has no slope; leave out on_surface, or the volume.",
        "Air has no slope; leave out --surface, or the volume.",
    ),
    ("dop", "D1 is out; give its altitude_m instead of above_ground_m.", f"D1 is out; {ALTITUDE}."),
    ("dop", "path[3] lies outside the DEM.", "--path (number 4) lies outside the DEM."),
    ("place", "goal.min_anchors: Input should be a number.", "--min-anchors: Input should be a number."),
    ("place", "reach: Input should be at most 1.", "--reach: Input should be at most 1."),
    ("place", "min_above_ground_m 5 is above max_above_ground_m 3.", "--min-agl 5 is above --max-agl 3."),
    ("plan", "rover.max_slope_deg: Input should be less than 90.", "--max-slope: Input should be less than 90."),
    ("los", "--from: above_ground_m: Input should be at least 0.", "--from: HEIGHT: Input should be at least 0."),
    (
        "info",
        "x.npy holds heights alone; give cell_m=, the metres.",
        "x.npy holds heights alone; give --cell-m, the metres.",
    ),
    ("info", "kept (give nodata=-9999 if they are fill).", "kept (give --nodata -9999 if they are fill)."),
    ("info", "unknown ground (give nodata=nan to keep).", "unknown ground (give --nodata nan to keep)."),
    ("detect", "range_sigma_m is 0.1 m: is that too small?", "--range-sigma is 0.1 m: is that too small?"),
    ("detect", "The settings: k_geometric: too small.", "The settings: --set k_geometric: too small."),
]


def typed(monkeypatch, *words):
    monkeypatch.setattr(module.sys, "argv", ["sightline", *words])


@pytest.mark.parametrize(("command", "written", "said"), SAID, ids=[f"{one}-{text[:20]}" for one, text, _ in SAID])
def test_fields_are_told_as_options(monkeypatch, command, written, said):
    typed(monkeypatch, command, "dem.tif")
    assert spoken(written) == said


@pytest.mark.parametrize(
    "sentence",
    [
        "drones.csv, line 3: Anchor D1: give exactly one of above_ground_m and altitude_m; both were given.",
        "The anchors file drones.csv has the unknown column 'dop'; its first line names columns out of id, east_m.",
        "The DEM dop_limit.tif has 3 bands.",
        "Kind and mode are words like any other: the seed grows.",
        "The path keeps max_nothing_m.",
    ],
)
def test_columns_files_and_words_stay_as_they_are(monkeypatch, sentence):
    typed(monkeypatch, "dop", "dem.tif")
    assert spoken(sentence) == sentence


def test_a_request_in_a_file_is_told_in_its_own_words(monkeypatch):
    for words in (("--request", "asked.json"), ("--request=asked.json",)):
        typed(monkeypatch, "dop", "dem.tif", *words)
        assert spoken("dop_limit: Input should be greater than 0.") == "dop_limit: Input should be greater than 0."


# what each command needs besides, so that the number is what is wrong
AT = f"{WEST_M + 120},{NORTH_M - 420}"
ANCHOR = ("--anchor", f"D1,{AT},80agl")
BASE = {
    "visibility": ANCHOR,
    "dop": (*ANCHOR, "--ceiling", "300agl"),
    "morph": (*ANCHOR, "--ceiling", "300agl"),
    "plan": (*ANCHOR, "--start", AT, "--goal", f"{WEST_M + 300},{NORTH_M - 420}"),
    "fly": ("--start", f"{AT},80agl", "--goal", f"{WEST_M + 300},{NORTH_M - 420},80agl"),
    "place": ("--spacing", 200, "--height", "60agl", "--count", 2),
    "reposition": (*ANCHOR, "--rover", AT, "--heading", 20),
    "los": ("--from", f"{AT},80agl", "--to", f"{WEST_M + 300},{NORTH_M - 420},2agl"),
}
NUMBERS = [
    (command, argument.name)
    for command in BASE
    for argument in command_line()[command].assemble_argument_collection()
    if float in (argument.hint, *get_args(argument.hint))
    and argument.name.startswith("--")
    and argument.name != "--nodata"
]


@pytest.mark.parametrize(("command", "option"), NUMBERS, ids=[f"{one} {two}" for one, two in NUMBERS])
def test_an_option_with_a_number_that_cannot_be_is_told_by_its_name(sightline, dem_file, command, option):
    assert set(BASE) <= set(COMMANDS)
    trees = dict.fromkeys(("--canopy-base", "--canopy-density", "--canopy-season"), ("--canopy-height", 5))
    more = {"--link-range": ("--base", f"{AT},10agl"), **trees}.get(option, ())
    base = [word for word in BASE[command] if option != "--reach" or word not in ("--count", 2)]
    ended = sightline(command, dem_file, *base, *more, option, "-1e300")
    assert (ended.code, ended.stdout) == (2, ""), ended
    assert option in ended.stderr
    # no field of a request; ids and words of the sentence have no underscore
    assert not re.search(r"\b[a-z]+(_[a-z0-9]+)+\b", ended.stderr), ended.stderr
