"""Bad input ends with exit code 2 and one clear sentence on stderr, whatever was wrong."""

import errno
import json
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import service.cli
import service.cli.output
import service.products.visibility
import service.products.visibility.files
from tests.service.small_maps import NORTH_M, WEST_M

GOOD = f"D1,{WEST_M + 95},{NORTH_M - 305},12agl"
HOLE = f"D1,{WEST_M + 270},{NORTH_M - 100},12agl"

BAD_LINES = [
    (["--anchor", "D1"], "--anchor 'D1' is not of the form ID,EAST,NORTH,HEIGHT"),
    (["--anchor", "D1,1,2"], "is not of the form"),
    (["--anchor", "D1,1,2,80"], "HEIGHT like 80agl (above ground), 612msl (sea level) or 650hae"),
    (["--anchor", "D1,1,2,agl"], "is not of the form"),
    (["--anchor", "D1,a,2,80agl"], "is not of the form"),
    (["--anchor", "D1,1,2,80agl,5"], "is not of the form"),
    (["--anchor", "D1,1_0,2,80agl"], "is not of the form"),
    (["--anchor", "D1,1,2,8_0agl"], "is not of the form"),
    (["--anchor", "D1,nan,2,80agl"], "EAST: Input should be a finite number"),
    (["--anchor", "D1,inf,2,80agl"], "EAST: Input should be a finite number"),
    (["--anchor", ",1,2,80agl"], "id: String should have at least 1 character"),
    (["--anchor", GOOD.replace("12agl", "-1agl")], "-1agl': HEIGHT: Input should be greater"),
    (["--anchor", GOOD.replace("12agl", "-50msl")], "below the ground"),
    (["--anchor", HOLE], "Anchor D1 stands on unknown ground; give its altitude (612msl) instead"),
    (["--anchor", f"D1,{WEST_M - 200},{NORTH_M},80agl"], "Anchor D1 stands outside the DEM, 200 m beyond its border"),
    (
        ["--anchor", "D1,-118.2,34.3,80agl"],
        "km outside the DEM (limit 1000 km); are its coordinates metres in the DEM's",
    ),
    (["--anchor", "D1,-118.2,34.3,900msl"], "or degrees that were not said to be, or swapped?"),
    (
        ["--lonlat", "--anchor", "D1,34.3,-118.2,80agl"],
        "-118.2 degrees is no latitude; --lonlat takes the longitude first",
    ),
    (["--anchor", f"D1,{WEST_M + 3e6},{NORTH_M},80msl"], "km outside the DEM"),
    (["--anchor", GOOD, "--anchor", GOOD], "Anchor ids must be unique; repeated: D1"),
    (["--lonlat", "--anchor", "D1,400000,3800000,80agl"], "LON: Input should be less than or equal to 360"),
    ([], "At least one anchor is needed"),
    (["--anchor", GOOD, "--receiver-height", "-1"], "--receiver-height: Input should be greater than or equal"),
    (["--anchor", GOOD, "--receiver-height", "nan"], "--receiver-height"),
    (["--anchor", GOOD, "--receiver-height", "1", "--receiver-altitude", "5"], "only one of --receiver-height and"),
    (["--anchor", GOOD, "--mode", "best"], "'best' is not one of"),
    (["--anchor", GOOD, "--curvature", "round"], "'round' is not one of"),
    (["--anchor", GOOD, "--receiver-height", "high"], "'--receiver-height': "),
    (["--anchor", GOOD, "--wat"], "No such option"),
    (["--anchor", GOOD, "more"], "unexpected extra argument"),
    (["--anchor", GOOD, "--crs", "EPSG:1"], "EPSG:1"),
    (["--anchors", "missing.json"], "The anchors file 'missing.json' cannot be read: No such file"),
]


MAST = (
    "<kml><Placemark><ExtendedData><Data name='max_range_m'><value>%s</value></Data></ExtendedData>"
    "<Point><altitudeMode>relativeToGround</altitudeMode><coordinates>-118.1,34.3,30</coordinates></Point>"
    "</Placemark></kml>"
)
POINT = '{"type": "FeatureCollection", "features": [{"geometry": {"type": "Point", "coordinates": %s}}]}'


def is_one_sentence(text):
    return text.count("\n") == 1 and text.endswith((".\n", "?\n")) and "Traceback" not in text


@pytest.mark.parametrize(("words", "sentence"), BAD_LINES, ids=[" ".join(words)[:40] for words, _ in BAD_LINES])
def test_a_bad_visibility_line_is_refused(sightline, dem_file, tmp_path, words, sentence):
    out = tmp_path / "out"
    ended = sightline("visibility", dem_file, *words, "--out", out, "--json")
    ended.refused(sentence)
    assert not list(out.glob("*"))


def _no_raster(path):
    path.write_text("this is no raster at all\n")


def _empty(path):
    path.touch()


def _vrt(path):
    path.write_text(
        '<VRTDataset rasterXSize="1" rasterYSize="1"><SourceFilename>/etc/passwd</SourceFilename></VRTDataset>'
    )


def _all_void(path):
    np.save(path, np.full((4, 4), np.nan))


def _folder(path):
    path.mkdir()


@pytest.mark.parametrize("make", [_no_raster, _empty, _vrt, _folder])
@pytest.mark.parametrize("command", ["info", "visibility"])
def test_what_is_no_dem_is_refused(sightline, tmp_path, make, command):
    path = tmp_path / "bad.tif"
    make(path)
    ended = sightline(command, path, *(["--anchor", GOOD] if command == "visibility" else []))
    ended.refused("bad.tif")


@pytest.mark.parametrize("dem", ["/nowhere/dem.tif", "https://example.com/dem.tif", "/vsicurl/https://example.com/a"])
def test_a_dem_that_is_not_here_is_refused(sightline, dem):
    ended = sightline("info", dem)
    assert ended.code == 2
    assert is_one_sentence(ended.stderr)


@pytest.mark.parametrize("words", [["teleport"], ["info"], ["--nope"], ["serve", "--port", "many"]])
def test_a_line_that_is_no_command_is_refused(sightline, words):
    ended = sightline(*words)
    assert ended.code == 2
    assert is_one_sentence(ended.stderr)


def test_no_words_at_all_show_the_help(sightline):
    ended = sightline()
    assert ended.code == 2
    assert "visibility" in ended.stdout
    assert is_one_sentence(ended.stderr)


def test_a_port_beyond_the_range_is_refused(sightline, tmp_path):
    ended = sightline("serve", "--port", "70000", "--data", tmp_path)
    ended.refused("port")


def test_an_output_folder_that_is_a_file_is_refused(sightline, dem_file, tmp_path):
    (tmp_path / "out").write_text("mine")
    ended = sightline("visibility", dem_file, "--anchor", GOOD, "--out", tmp_path / "out")
    assert ended.code == 2
    assert "output folder" in ended.stderr
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize("name", ["visible.tif", "map.png", "visibility.json"])
def test_a_folder_where_a_file_is_to_be_written_is_refused(sightline, dem_file, tmp_path, name):
    (tmp_path / name).mkdir()
    ended = sightline("visibility", dem_file, "--anchor", GOOD, "--out", tmp_path)
    assert ended.code == 2
    assert ended.stderr == f"{tmp_path / name} is a folder where a file is needed; move it away or name another.\n"
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("words", [[], ["--json"]])
def test_output_that_nobody_reads_ends_without_a_traceback(dem_file, words):
    unread, output = os.pipe()
    os.close(unread)
    command = [sys.executable, "-m", "service.cli", "info", str(dem_file), *words]
    try:
        ended = subprocess.run(command, stdout=output, stderr=subprocess.PIPE, check=False, timeout=60)
    finally:
        os.close(output)
    assert (ended.returncode, ended.stderr) == (1, b"")


@pytest.mark.parametrize("command", ["visibility", "place", "dop", "morph", "bubble", "plan", "reposition"])
def test_a_folder_that_nothing_can_be_put_into_is_refused_before_the_calculation(
    sightline, dem_file, tmp_path, monkeypatch, command
):
    path = tmp_path / "path.csv"
    path.write_text(f"east_m,north_m,above_ground_m\n{WEST_M + 200.0},{NORTH_M - 200.0},1.5\n")
    here = f"{WEST_M + 200.0},{NORTH_M - 200.0}"
    words = {
        "place": ["--count", 1, "--spacing", 150, "--height", "40agl"],
        "morph": ["--anchor", GOOD, "--ceiling", "900msl"],
        "bubble": ["--anchor", GOOD, "--path", path],
        "plan": ["--start", here, "--goal", here],
        "reposition": ["--anchor", GOOD, "--rover", here, "--heading", 0, "--ahead", 100],
    }.get(command, ["--anchor", GOOD])
    monkeypatch.setattr(service.cli.output.os, "access", lambda path, mode: path.name != "out")
    ended = sightline(command, dem_file, *words, "--out", tmp_path / "out")
    ended.refused("cannot be written into")


def test_a_full_disk_is_a_fault_and_leaves_no_broken_file(sightline, dem_file, tmp_path, monkeypatch):
    def fill_up(path, *_):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(service.products.visibility.files, "write_cog", fill_up)
    ended = sightline("visibility", dem_file, "--anchor", GOOD, "--out", tmp_path)
    assert ended.code == 1
    assert "No space left on device" in ended.stderr
    assert is_one_sentence(ended.stderr)
    assert list(tmp_path.iterdir()) == []


def calculate_with(monkeypatch, calculate):
    changed = replace(service.products.visibility.VISIBILITY_MAP, calculate=calculate)
    monkeypatch.setattr(service.products.visibility, "VISIBILITY_MAP", changed)


def test_an_unforeseen_fault_shows_where_it_happened(dem_file, monkeypatch):
    def stumble(*_):
        raise ZeroDivisionError("a mistake of ours")

    calculate_with(monkeypatch, stumble)
    monkeypatch.setattr("sys.argv", ["sightline", "visibility", str(dem_file), "--anchor", GOOD])
    with pytest.raises(ZeroDivisionError, match="a mistake of ours"):
        service.cli.main()


def test_an_interrupted_command_says_so(sightline, dem_file, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    calculate_with(monkeypatch, interrupt)
    ended = sightline("visibility", dem_file, "--anchor", GOOD)
    assert (ended.code, ended.stderr) == (130, "Interrupted.\n")


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.txt", "x", "must end in .json, .geojson, .csv, .kml, .kmz, .gpx or .plan"),
        ("a.json", "{", "is not JSON"),
        ("a.json", "[]", "holds no anchors"),
        ("a.json", "{}", "must hold a list of anchors"),
        ("a.json", "3", "must hold a list of anchors"),
        ("a.json", "[3]", "a.json, anchor 1: an anchor must be an object"),
        ("a.json", '[{"id": "D1"}]', "a.json, anchor 1: Anchor D1: give exactly one of the pairs"),
        ("a.json", '[{"id": "D1", "east_m": NaN, "north_m": 1, "altitude_m": 2}]', "anchor 1: east_m: Input should be"),
        ("a.json", '[{"id": "D1", "east": 1}]', "anchor 1: east: this field is not known here"),
        ("a.json", "[" * 100_000, "is not JSON"),
        ("a.json", f"[{'9' * 5000}]", "is not JSON"),
        ("a.geojson", '{"type": "FeatureCollection", "features": [{"geometry": {"type": "Polygon"}}]}', "only Point"),
        ("a.geojson", '{"type": "FeatureCollection", "features": [7]}', "only Point"),
        ("a.geojson", POINT % "[1]",
         "two coordinates"),
        ("a.geojson", POINT % "[1, 2]",
         "feature 1: Anchor 1: give exactly one of above_ground_m and altitude_m; neither was given"),
        ("a.csv", "", "no column 'id'"),
        ("a.csv", "id,east\nD1,3\n", "unknown column 'east'"),
        ("a.csv", "id,east_m,north_m,altitude_m\nD1,1,two,3\n", "a.csv, line 2: north_m is 'two', not a number"),
        ("a.csv", "id,east_m\nD1,1,2\n", "line 2: more cells than columns"),
        ("a.csv", "id,east_m,north_m,altitude_m\n", "holds no anchors"),
        ("a.csv", "id,east_m,north_m,altitude_m\nD1,1,nan,3\n", "line 2: north_m: Input should be a finite number"),
        ("a.csv", "id,east_m,north_m,altitude_m\nD1,1_0,2,3\n", "a.csv, line 2: east_m is '1_0', not a number"),
        ("a.csv", 'id,east_m\n"D1,1\n', "is not CSV"),
        ("a.kml", MAST % "nan", "a.kml, point 1: max_range_m: Input should be a finite number"),
        ("a.kml", MAST % "1_0", "a.kml, point 1: max_range_m: Input should be a valid number"),
    ],
)  # fmt: skip
def test_a_bad_anchors_file_is_refused_with_its_place(sightline, dem_file, tmp_path, name, text, sentence):
    (tmp_path / name).write_text(text)
    ended = sightline("visibility", dem_file, "--anchors", tmp_path / name)
    ended.refused(sentence)


def test_an_anchors_file_that_is_not_text_is_refused(sightline, dem_file, tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\xff\x00i\x00d")
    ended = sightline("visibility", dem_file, "--anchors", tmp_path / "a.csv")
    assert (ended.code, ended.stderr) == (2, "The anchors file a.csv is not UTF-8 text.\n")


def test_degrees_on_a_local_dem_are_refused(sightline, tmp_path):
    np.savez(tmp_path / "local.npz", heights_m=np.zeros((5, 5)), cell_east_m=10.0, cell_north_m=10.0)
    ended = sightline("visibility", tmp_path / "local.npz", "--lonlat", "--anchor", "D1,1,2,5msl")
    ended.refused("no CRS")


def test_an_error_with_json_leaves_stdout_empty(sightline):
    ended = sightline("info", "/nowhere.tif", "--json")
    assert ended.stdout == ""
    with pytest.raises(json.JSONDecodeError):
        json.loads(ended.stdout)
