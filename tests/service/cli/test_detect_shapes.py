"""Logs and anchors in the shapes in which they come, and warnings of what ails a whole log, on the command line."""

import itertools
import json
import math
from pathlib import Path

import pyproj
import pytest

from tests.service.cli.test_detect_command import ANCHORS, HEAD, TEXTS, drive, read, write


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "drive.csv", drive())


def summary_of(sightline, log, *words):
    ended = sightline("detect", log, *words, "--json")
    assert ended.code == 0, ended.stderr
    return json.loads(ended.stdout)


def same(summary):
    return {key: summary[key] for key in ("epochs", "classifications", "planning", "anchors", "episodes")}


CSV = "\n".join([HEAD, *(f"{t},{name},{range_m:.3f}" for t, name, range_m in drive()), ""])
SHAPES = {
    "a byte-order mark": CSV.encode("utf-8-sig"),
    "UTF-16 as Excel writes it": CSV.replace(",", "\t").encode("utf-16"),
    "decimal commas": CSV.replace(",", ";").replace(".", ",").encode(),
    "decimal commas between tabs": CSV.replace(",", "\t").replace(".", ",").encode(),
    "a comment and an empty line first": b"# logged by rover 7\n\n" + CSV.encode(),
    "comments between": CSV.replace("\n5.0,D1", "\n# a pause, here\n5.0,D1", 1).encode(),
    "a comma at the end of each line": CSV.replace("\n", ",\n").encode(),
    "the separator announced": b"sep=;\n" + CSV.replace(",", ";").encode(),
    "names in a comment": b"# " + CSV.encode(),
    "ends of lines of DOS": CSV.replace("\n", "\r\n").encode(),
    "ISO times": "\n".join(
        [HEAD, *(f"2024-05-01T10:00:{t:06.3f}Z,{name},{range_m:.3f}" for t, name, range_m in drive())]
    ).encode(),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_logs_of_many_shapes_say_the_same(sightline, tmp_path, shape):
    plain, shaped = tmp_path / "plain.csv", tmp_path / "shaped.csv"
    plain.write_text(CSV)
    shaped.write_bytes(SHAPES[shape])
    expected, told = summary_of(sightline, plain, *TEXTS), summary_of(sightline, shaped, *TEXTS)
    begin_s = told["from_s"] - expected["from_s"]
    for episode in told["episodes"]:
        episode["from_s"] -= begin_s
        episode["to_s"] -= begin_s
    assert same(told) == same(expected)
    assert told["warnings"] == expected["warnings"] == []


def test_columns_that_no_log_has_are_passed_over_and_told(sightline, tmp_path):
    more = tmp_path / "more.csv"
    more.write_text(CSV.replace("\n", ",-80\n").replace("range_m,-80", "range_m,rssi", 1))
    told = summary_of(sightline, more, *TEXTS)
    assert told["warnings"] == ["Columns that no log has were passed over: rssi."]
    assert told["planning"] == {"checked": 20, "degraded": 10}


def test_cells_that_say_null_hold_nothing(sightline, tmp_path):
    wide = tmp_path / "wide.csv"
    wide.write_text("time_s,range_m.D1,range_m.D2\n0,NULL,348.5\n1,156.6,NULL\n2,N/A,None\n3,\\N,-\n")
    told = summary_of(sightline, wide, *TEXTS)
    assert [anchor["ranges"] for anchor in told["anchors"]] == [1, 1, 0, 0, 0, 0]
    long = tmp_path / "long.csv"
    long.write_text(f"{HEAD}\n0,D1,NULL\n0,NA,5\n")
    assert summary_of(sightline, long, *TEXTS)["rejections"] == {"not finite": 1, "unknown anchor": 1}


def test_a_log_of_ros_needs_no_more_than_the_unit_of_its_ranges(sightline, tmp_path):
    rows = [f"{round(1.7e18 + 1e9 * t)},7,{name},{1000.0 * range_m:.1f}" for t, name, range_m in drive()]
    log = tmp_path / "ros.csv"
    log.write_text("\n".join(["%time,field.header.seq,field.id,field.distanceFromTag", *rows]))
    asked = summary_of(sightline, log, *TEXTS)["warnings"]
    taken = "Taken are '%time' for time_s, 'field.id' for anchor_id, 'field.distanceFromTag' for range_m."
    assert taken in asked
    assert any("millimetres" in warning and "--range-unit mm" in warning for warning in asked)
    told = summary_of(sightline, log, *TEXTS, "--range-unit", "mm")
    assert told["warnings"] == [taken, "Columns that no log has were passed over: field.header.seq."]
    assert told["planning"] == {"checked": 20, "degraded": 10}
    named = "time_s=%time,anchor_id=field.id,range_m=field.distanceFromTag"
    same_again = summary_of(sightline, log, *TEXTS, "--columns", named, "--time-unit", "ns", "--range-unit", "mm")
    assert same(same_again) == same(told)


@pytest.mark.parametrize(("given", "factor"), [("ft", "0.305"), ("mm", "0.001"), ("km", "1,000"), ("cm", "0.01")])
def test_the_unit_that_was_just_typed_is_suspected_first(sightline, log, given, factor):
    """The log is in metres; taken in another unit, nothing else is wrong with it."""
    assert summary_of(sightline, log, *TEXTS)["warnings"] == []
    told = summary_of(sightline, log, *TEXTS, "--range-unit", given)["warnings"]
    assert any(
        warning
        == f"Taken with --range-unit {given} the ranges are about {factor} times what fits the anchors: are they "
        "in m? Then say --range-unit m."
        for warning in told
    ), told


def test_ids_that_nobody_named_are_told(sightline, tmp_path):
    rows = [f"{t},{name},{range_m}" for t, name, range_m in drive()]
    rows += [f"{t},tag {n},5" for t in (1.0, 2.0) for n in range(7)]
    log = tmp_path / "strange.csv"
    log.write_text("\n".join([HEAD, *sorted(rows, key=lambda row: float(row.split(",")[0]))]))
    (told,) = [one for one in summary_of(sightline, log, *TEXTS)["warnings"] if "were not used" in one]
    assert told == (
        "Ranges to 'tag 0', 'tag 1', 'tag 2', 'tag 3', 'tag 4' and 2 more were not used: no --anchor or --anchors "
        "names them."
    )


@pytest.mark.parametrize("way", ["typed", "file"])
def test_anchors_without_heights_are_told_of_the_plane(sightline, log, tmp_path, way):
    (tmp_path / "flat.csv").write_text("id,east_m,north_m\nD1,0,0\nD2,9,9\n")
    words = ("--anchors", tmp_path / "flat.csv") if way == "file" else ("--anchor", "D1,0,0")
    ended = sightline("detect", log, *words)
    assert (ended.code, ended.stdout) == (2, "")
    assert "--dimension 2" in ended.stderr
    assert "above_ground_m" not in ended.stderr


def test_one_occlusion_is_one(sightline, log):
    told = sightline("detect", log, *TEXTS).stdout
    episodes = summary_of(sightline, log, *TEXTS)["episodes"]
    assert len(episodes) == 1
    assert "1 occlusion\n" in told.replace("  ", "").replace(" \n", "\n")


def degrees_of(places, lon_deg, lat_deg):
    """Places in metres about a place on Earth, by PROJ's topocentric conversion."""
    to_ecef = pyproj.Transformer.from_pipeline(
        f"+proj=pipeline +step +inv +proj=topocentric +ellps=WGS84 +lon_0={lon_deg} +lat_0={lat_deg} +h_0=0 "
        "+step +inv +proj=cart +ellps=WGS84 +step +proj=unitconvert +xy_in=rad +xy_out=deg"
    )
    return {name: to_ecef.transform(*place) for name, place in places.items()}


@pytest.mark.parametrize("place", [(8.3, 46.8), (179.9999, -17.7), (-117.3, 34.3)])
def test_anchors_as_sightline_writes_them_are_taken_in_degrees(sightline, log, tmp_path, place):
    points = degrees_of(ANCHORS, *place)
    collection = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "id": name, "properties": {"altitude_m": up_m, "ranging_sigma_m": 0.1, "gain_m2": 5},
             "geometry": {"type": "Point", "coordinates": [(lon + 180.0) % 360.0 - 180.0, lat]}}
            for name, (lon, lat, up_m) in points.items()
        ],
    }  # fmt: skip
    (tmp_path / "anchors.geojson").write_text(json.dumps(collection))
    told = summary_of(sightline, log, "--anchors", tmp_path / "anchors.geojson", "--range-sigma", "0.05")
    metric = summary_of(sightline, log, *TEXTS, "--range-sigma", "0.05")
    assert (told["classifications"], told["planning"]) == (metric["classifications"], metric["planning"])
    assert told["frame"]["lat_deg"] == pytest.approx(place[1], abs=0.01)
    assert metric["frame"] is None
    (warning,) = told["warnings"]
    assert "Anchors came in degrees: east and north are metres from longitude, latitude" in warning
    apart_m = [
        math.dist([a[key] for key in ("east_m", "north_m", "altitude_m")],
                  [b[key] for key in ("east_m", "north_m", "altitude_m")])
        for a, b in zip(told["anchors"], told["anchors"][1:], strict=False)
    ]  # fmt: skip
    true_m = [math.dist(a, b) for a, b in itertools.pairwise(ANCHORS.values())]
    assert apart_m == pytest.approx(true_m, abs=1e-4)


def test_anchors_partly_in_degrees_are_refused(sightline, log, tmp_path):
    (tmp_path / "some.csv").write_text("id,lon_deg,lat_deg,altitude_m\nZ,8.3,46.8,100\n")
    ended = sightline("detect", log, *TEXTS, "--anchors", tmp_path / "some.csv")
    assert (ended.code, "Anchor Z is in degrees and D1 in metres" in ended.stderr) == (2, True)


def test_what_a_whole_log_suffers_from_is_a_warning_and_what_is_needed_is_written(sightline, tmp_path):
    rows = [(t, name, range_m + 2.0) for t, name, range_m in drive()]
    told = summary_of(sightline, write(tmp_path / "late.csv", rows), *TEXTS, "--range-sigma", "0.05")
    assert any("m too long" in warning and "antenna delay" in warning for warning in told["warnings"])
    few = write(tmp_path / "few.csv", [row for row in drive() if row[1] in ("D1", "D2")])
    told = summary_of(sightline, few, *TEXTS, "--out", tmp_path / "out")
    assert told["needed"] == {"2 more ranges: 2 allow no position.": 30}
    assert any("Only 0% of the epochs have a position." in warning for warning in told["warnings"])
    assert read(tmp_path / "out" / "positions.csv")[0]["needed"] == "2 more ranges: 2 allow no position."
    assert "2 more ranges: 2 allow no position." in sightline("detect", few, *TEXTS).stdout


def test_ranges_that_are_too_short_have_a_column_of_their_own(sightline, tmp_path):
    log = write(tmp_path / "short.csv", drive(extra_m=-4.0))
    ended = sightline("detect", log, *TEXTS, "--range-sigma", "0.05", "--out", tmp_path / "out")
    rows = [row for row in read(tmp_path / "out" / "verdicts.csv") if row["sight"] == "too short"]
    assert {row["anchor_id"] for row in rows} == {"D4"}
    assert len(rows) >= 8
    assert {row["occluded"] for row in rows} == {"0"}
    assert "too" in ended.stdout
    episodes = json.loads((tmp_path / "out" / "detection.json").read_text())["episodes"]
    short_s = [float(row["time_s"]) for row in rows]
    assert not [one for one in episodes if any(one["from_s"] <= time_s <= one["to_s"] for time_s in short_s)]


CASES = Path(__file__).resolve().parents[4] / "shared" / "cases"
CASE_WARNINGS = {
    "antenna-delay/plus_half_metre.csv": ([], "All ranges are about 0.50 m too long"),
    "time-in-ms/ms.csv": ([], "Epochs are 1000 s apart (median): is time_s in milliseconds? Then say --time-unit ms."),
    "no-position-no-word/mm.csv": ([], "are the ranges in millimetres"),
    "csv-shapes/rssi.csv": ([], "passed over: rssi"),
}


@pytest.mark.parametrize("case", CASE_WARNINGS)
def test_the_cases_are_warned_of(sightline, case):
    log = CASES / case
    if not log.exists():
        pytest.skip("the cases are not beside the checkout")
    words, sentence = CASE_WARNINGS[case]
    told = summary_of(sightline, log, "--anchors", log.parent / "anchors.csv", "--range-sigma", "0.05", *words)
    assert any(sentence in warning for warning in told["warnings"])
