"""sightline dop and sightline morph refuse bad input in one sentence."""

import pytest

from tests.service.cli.positioning_words import ANCHORS
from tests.service.skies import TIME
from tests.service.small_maps import NORTH_M, WEST_M

ONE_LINE = [word for n in range(4) for word in ("--anchor", f"L{n},{WEST_M + 100 + 50 * n},{NORTH_M - 200},300msl")]
BAD_LINES = [
    ("dop", [], "Nothing to range to: give --anchor"),
    ("dop", ANCHORS[:4], "needs at least 3 anchors; 2 are given"),
    ("dop", [*ANCHORS[:6], "--kind", "tdoa"], "needs at least 4 anchors; 3 are given"),
    ("dop", ONE_LINE, "All 4 anchors stand on one line"),
    ("dop", [*ANCHORS, "--dop-limit", "0"], "--dop-limit: Input should be greater than 0"),
    ("dop", [*ANCHORS, "--dop-limit", "nan"], "--dop-limit"),
    ("dop", [*ANCHORS, "--min-anchors", "0"], "--min-anchors: Input should be greater than or equal to 1"),
    ("dop", [*ANCHORS, "--min-anchors", "9"], "needs at least 9 anchors; 4 are given"),
    ("dop", [*ANCHORS, "--receiver-height", "-1"], "--receiver-height"),
    ("dop", [*ANCHORS, "--measure", "best"], "'best' is not one of"),
    ("dop", [*ANCHORS, "--time", TIME], "--time, --reference-date, --cone-deg and --sky-at need --almanac"),
    ("dop", ["--almanac", "missing.al3", "--time", TIME], "The almanac 'missing.al3' cannot be read"),
    ("morph", ANCHORS, "Missing option '--ceiling': Top of the air: 2500msl"),
    ("morph", [*ANCHORS, "--ceiling", "300"], "--ceiling '300' is not of the form"),
    ("morph", [*ANCHORS, "--ceiling", "-100msl"], "is below the ground, which begins at"),
    ("morph", [*ANCHORS, "--ceiling", "0agl"], "--ceiling: Input should be greater than 0"),
    ("morph", [*ONE_LINE, "--ceiling", "300agl"], "All 4 anchors stand on one line"),
    ("morph", [*ANCHORS[:4], "--ceiling", "300agl"], "needs at least 3 anchors; 2 are given"),
]  # fmt: skip


@pytest.mark.parametrize(("command", "words", "sentence"), BAD_LINES, ids=[line[2][:40] for line in BAD_LINES])
def test_a_bad_line_is_refused_in_one_sentence(sightline, dem_file, tmp_path, command, words, sentence):
    ended = sightline(command, dem_file, *words, "--out", tmp_path / "out", "--json")
    ended.refused(sentence)
    assert not list((tmp_path / "out").glob("*"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("east_m,north_m,above_ground_m\n", "holds no points"),
        ("x,y\n1,2\n", "unknown column 'x'"),
        ("east_m,north_m,above_ground_m\n1,2,high\n", "line 2: its cells must be numbers"),
        ("east_m,north_m\n1,2\n", "exactly one of above_ground_m and altitude_m"),
        ("east_m,north_m,above_ground_m\n0,0,2\n", "--path (number 1) lies outside the DEM"),
    ],
)
def test_a_path_that_is_none_is_refused_in_one_sentence(sightline, dem_file, tmp_path, text, sentence):
    (tmp_path / "way.csv").write_text(text)
    ended = sightline("dop", dem_file, *ANCHORS, "--path", tmp_path / "way.csv")
    assert (ended.code, sentence in ended.stderr) == (2, True), ended.stderr
