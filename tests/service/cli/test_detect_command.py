"""``sightline detect``: a log of ranges to a table and files; bad logs end with exit code 2 and one sentence."""

import csv
import itertools
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyproj
import pytest
from PIL import Image

from detection import Detector, DetectorSettings, RangeEpoch, RangeMeasurement, RangingAnchor

ANCHORS = {
    "D1": (0.0, 0.0, 120.0),
    "D2": (400.0, 30.0, 60.0),
    "D3": (380.0, 420.0, 140.0),
    "D4": (-20.0, 390.0, 80.0),
    "D5": (240.0, 150.0, 160.0),
    "D6": (90.0, 250.0, 40.0),
}
TEXTS = [word for name, (e, n, u) in ANCHORS.items() for word in ("--anchor", f"{name},{e},{n},{u}msl")]


def drive(occluded="D4", begin_s=10, end_s=20, extra_m=4.0):
    """Rows of a drive of 30 s past the anchors, one of which is occluded for a while."""
    generator = np.random.default_rng(3)
    rows = []
    for second in range(30):
        rover = (60.0 + 3.0 * second, 80.0 + 2.0 * second, 2.0)
        for name, place in ANCHORS.items():
            too_long_m = extra_m * (name == occluded and begin_s <= second < end_s)
            rows.append((float(second), name, math.dist(place, rover) + too_long_m + generator.normal(0.0, 0.05)))
    return rows


def write(path, rows, header="time_s,anchor_id,range_m"):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows), ""]), encoding="utf-8")
    return path


@pytest.fixture
def log(tmp_path):
    return write(tmp_path / "drive.csv", drive())


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_files_hold_what_the_python_call_says(sightline, log, tmp_path):
    ended = sightline("detect", log, *TEXTS, "--range-sigma", "0.05", "--out", tmp_path / "out")
    assert ended.code == 0, ended.stderr
    detector = Detector(
        [RangingAnchor(name, *at) for name, at in ANCHORS.items()], DetectorSettings(range_sigma_m=0.05)
    )
    here = []
    for second in range(30):
        ranges = [RangeMeasurement(name, range_m, time_s=t) for t, name, range_m in drive() if t == second]
        here.append(detector.process(RangeEpoch(float(second), tuple(ranges))))
    verdicts = read(tmp_path / "out" / "verdicts.csv")
    assert [(row["anchor_id"], row["sight"], row["reason"]) for row in verdicts] == [
        (verdict.anchor_id, str(verdict.sight), verdict.reason) for result in here for verdict in result.verdicts
    ]
    positions = read(tmp_path / "out" / "positions.csv")
    assert [row["excluded"].split() for row in positions] == [list(result.excluded) for result in here]
    for row, result in zip(positions, here, strict=True):
        told = [float(row[name]) for name in ("east_m", "north_m", "altitude_m")]
        assert told == pytest.approx(result.position.position_m.tolist(), rel=1e-5)


def test_the_summary_tells_who_was_occluded_and_when(sightline, log, tmp_path):
    ended = sightline("detect", log, *TEXTS, "--json", "--out", tmp_path / "out")
    summary = json.loads(ended.stdout)
    occluded = {anchor["id"] for anchor in summary["anchors"] if anchor["occluded_share"] > 0.2}
    assert occluded == {"D4"}
    assert (summary["epochs"], summary["epochs_used"], summary["from_s"], summary["to_s"]) == (30, 30, 0.0, 29.0)
    longest = max(summary["episodes"], key=lambda episode: episode["ranges"])
    assert longest["anchor_id"] == "D4"
    assert longest["from_s"] >= 10.0
    assert longest["to_s"] <= 20.0
    assert longest["greatest_excess_m"] == pytest.approx(4.0, abs=0.5)
    assert sum(summary["planning"].values()) == 30
    written = json.loads((tmp_path / "out" / "detection.json").read_text())
    assert {**written, "files": summary["files"]} == summary
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "detection.json", "positions.csv", "verdicts.csv", "verdicts.png",
    ]  # fmt: skip


def test_the_picture_shows_occlusion_where_it_was(sightline, log, tmp_path):
    sightline("detect", log, *TEXTS, "--out", tmp_path / "out")
    pixels = np.asarray(Image.open(tmp_path / "out" / "verdicts.png").convert("RGB")).astype(int)
    red = (np.abs(pixels - (0xD1, 0x41, 0x0C)).sum(axis=2) < 30)[:, : int(0.82 * pixels.shape[1])]
    share = np.nonzero(red)[1] / pixels.shape[1]
    # the axes reach from 10 % to 82 % of the width, the drive from 0 to 29 s
    assert 0.1 + 0.72 * 9.0 / 29.0 < share.min() < 0.1 + 0.72 * 12.0 / 29.0
    assert 0.1 + 0.72 * 17.0 / 29.0 < share.max() < 0.1 + 0.72 * 21.0 / 29.0


def test_the_table_is_for_people(sightline, log):
    said = sightline("detect", log, *TEXTS).stdout
    assert "30 of 30 used" in said
    assert "Anchors" in said
    assert "occlusions" in said


def test_two_dimensions_need_no_heights(sightline, tmp_path):
    rows = [(float(t), name, math.dist(ANCHORS[name][:2], (100.0 + t, 90.0))) for t in range(5) for name in ANCHORS]
    log = write(tmp_path / "level.csv", rows)
    write(tmp_path / "anchors.csv", [(name, *at[:2]) for name, at in ANCHORS.items()], "id,east_m,north_m")
    by_file = sightline("detect", log, "--dimension", "2", "--anchors", tmp_path / "anchors.csv", "--json")
    texts = [word for name, (e, n, _) in ANCHORS.items() for word in ("--anchor", f"{name},{e},{n}")]
    by_text = sightline("detect", log, "--dimension", "2", *texts, "--json")
    for ended in (by_file, by_text):
        assert ended.code == 0, ended.stderr
        assert json.loads(ended.stdout)["classifications"] == {"none": 5}


def test_what_a_sensor_delivers_wrongly_is_counted_and_the_replay_goes_on(sightline, tmp_path):
    rows = drive()
    rows[0] = (0.0, "D1", "nan")
    rows[6] = (1.0, "D1", "-5")
    rows[12] = (2.0, "D1", "inf")
    rows[18] = (3.0, "D1", "1e300")
    rows.insert(30, (4.0, "Z", 12.0))  # an unknown anchor
    rows.append((29.0, "D1", 100.0))  # D1 twice in one epoch
    rows.append((28.5, "D2", 100.0))  # back in time
    ended = sightline("detect", write(tmp_path / "log.csv", rows), *TEXTS, "--json", "--out", tmp_path / "out")
    assert ended.code == 0, ended.stderr
    summary = json.loads(ended.stdout)
    assert summary["rejections"] == {
        "not finite": 2, "not positive": 1, "longer than any range can be": 1, "unknown anchor": 1,
        "anchor twice in one epoch": 2, "older than the epoch before it": 1,
    }  # fmt: skip
    assert summary["epochs_used"] == 30
    reasons = [row["reason"] for row in read(tmp_path / "out" / "verdicts.csv") if not row["sight"]]
    assert sorted(reasons) == sorted(
        ["not finite"] * 2 + ["not positive", "longer than any range can be", "unknown anchor"]
        + ["anchor twice in one epoch"] * 2 + ["older than the epoch before it"]
    )  # fmt: skip


def test_settings_come_as_options_and_by_name(sightline, log):
    summary = json.loads(
        sightline(
            "detect", log, *TEXTS, "--max-speed", "4", "--tolerance", "0.2", "--set", "terrain=complex", "--set",
            "window=7", "--set", "side_hint_m=[1, 2]", "--json",
        ).stdout
    )  # fmt: skip
    settings = summary["settings"]
    assert (settings["max_speed_m_per_s"], settings["geometric_tolerance_m"]) == (4.0, 0.2)
    assert (settings["terrain"], settings["window"], settings["side_hint_m"]) == ("complex", 7, [1.0, 2.0])


HEAD = "time_s,anchor_id,range_m"
BAD_LOGS = {
    "nothing": ("", "no column 'time_s'"),
    "only a header": (f"{HEAD}\n", "holds no ranges"),
    "another name": ("time_s,anchor_id,dist\n1,D1,5\n", "--columns time_s=time_s,anchor_id=anchor_id,range_m=dist"),
    "points and commas": ("time_s;anchor_id;range_m\n1;D1;5,5\n1;D2;5.5\n", "line 3: range_m is '5.5'; other numbers"),
    "a comma too many": (f"{HEAD}\n1,D1,5,5\n", "line 2: more cells than columns"),
    "numbers and dates": (f"{HEAD}\n1,D1,5\n2024-05-01T10:00:00Z,D2,5\n", "line 3: time_s is '2024-05-01T10:00:00Z'"),
    "no ranges column": ("time_s,anchor_id\n1,D1\n", "no column 'range_m'"),
    "a word as range": (f"{HEAD}\n1,D1,five\n", "line 2: range_m is 'five', not a number"),
    "no time": (f"{HEAD}\n,D1,5\n", "line 2: time_s is missing"),
    "no range": (f"{HEAD}\n1,D1,\n", "line 2: range_m is missing"),
    "an empty row": (f"{HEAD}\n1,,\n", "line 2: neither a range"),
    "more cells than columns": (f"{HEAD}\n1,D1,5,6\n", "line 2: more cells than columns"),
    "a range and a motion": (f"{HEAD},duration_s\n1,D1,5,1\n", "line 2: a row is a range or a motion"),
    "a motion without duration": (f"{HEAD},wheel_x_m,wheel_y_m\n1,,,1,1\n", "line 2: a motion needs duration_s"),
    "half a motion": (f"{HEAD},duration_s,wheel_x_m,wheel_y_m\n1,,,1,1,\n", "wheel_x_m, wheel_y_m go together"),
    "a motion of nothing": (f"{HEAD},duration_s\n1,,,1\n", "line 2: a motion needs wheel_x_m"),
    "an open quote": (f'{HEAD}\n1,"D1,5\n', "is not CSV"),
}


@pytest.mark.parametrize("what", BAD_LOGS)
def test_a_log_that_is_none_ends_with_2_and_one_sentence(sightline, tmp_path, what):
    text, sentence = BAD_LOGS[what]
    log = tmp_path / "log.csv"
    log.write_text(text, encoding="utf-8")
    ended = sightline("detect", log, *TEXTS)
    assert ended.code == 2
    assert sentence in ended.stderr
    assert ended.stderr.count("\n") == 1
    assert ended.stdout == ""


BAD_LINES = [
    ([], "At least one anchor is needed"),
    ([*TEXTS, "--anchor", "D1,1,2,3msl"], "Anchor ids must be unique; repeated: D1"),
    (["--anchor", "D1,1,2"], "is not of the form ID,EAST,NORTH,HEIGHT with HEIGHT like 612msl"),
    (["--anchor", "D1,1,2,80agl"], "Anchor D1: a detector knows no ground"),
    (["--anchors", "missing.csv"], "cannot be read"),
    ([*TEXTS, "--tolerance", "0"], "geometric_tolerance_m must be a number > 0"),
    ([*TEXTS, "--tolerance", "-1"], "geometric_tolerance_m must be a number > 0"),
    ([*TEXTS, "--range-sigma", "nan"], "range_sigma_m: Input should be a finite number"),
    ([*TEXTS, "--dimension", "4"], "dimension: Input should be 2 or 3"),
    ([*TEXTS, "--epoch", "-1"], "--epoch must be a number of seconds"),
    ([*TEXTS, "--set", "colour=red"], "--set 'colour=red' is not of the form NAME=VALUE"),
    ([*TEXTS, "--set", "window"], "is not of the form NAME=VALUE"),
    ([*TEXTS, "--columns", "time_s"], "--columns 'time_s' is not of the form NAME=COLUMN"),
    ([*TEXTS, "--columns", "when=t"], "'when' is no column of a log"),
    ([*TEXTS, "--columns", "range_m=dist"], "has no column 'dist' as --columns says"),
    ([*TEXTS, "--time-unit", "h"], "A time unit is one of s, ms, us, ns, not 'h'"),
    ([*TEXTS, "--range-unit", "mile"], "A range unit is one of m, mm, cm, km, ft, not 'mile'"),
    ([w for n in range(63) for w in ("--anchor", f"A{n},{n},0,3msl")], "A detector takes at most 62 anchors, not 63"),
    (["--anchors", "missing.geojson"], "cannot be read"),
    ([*TEXTS, "--set", "window=many"], "window: Input should be a valid integer"),
]


@pytest.mark.parametrize(("words", "sentence"), BAD_LINES)
def test_bad_options_end_with_2_and_one_sentence(sightline, log, words, sentence):
    ended = sightline("detect", log, *words)
    assert ended.code == 2
    assert sentence in ended.stderr
    assert ended.stderr.count("\n") == 1


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


def test_a_log_of_ros_is_read_once_its_columns_and_its_unit_are_named(sightline, tmp_path):
    rows = [f"{round(1.7e18 + 1e9 * t)},7,{name},{1000.0 * range_m:.1f}" for t, name, range_m in drive()]
    log = tmp_path / "ros.csv"
    log.write_text("\n".join(["%time,field.header.seq,field.id,field.distanceFromTag", *rows]))
    refused = sightline("detect", log, *TEXTS)
    cure = "time_s=%time,anchor_id=field.id,range_m=field.distanceFromTag"
    assert refused.code == 2
    assert f"--columns {cure}." in refused.stderr
    asked = summary_of(sightline, log, *TEXTS, "--columns", cure)["warnings"]
    assert any("is time_s in nanoseconds? Then say --time-unit ns." in warning for warning in asked)
    assert any("millimetres" in warning and "--range-unit mm" in warning for warning in asked)
    told = summary_of(sightline, log, *TEXTS, "--columns", cure, "--time-unit", "ns", "--range-unit", "mm")
    assert told["warnings"] == ["Columns that no log has were passed over: field.header.seq."]
    assert told["planning"] == {"checked": 20, "degraded": 10}


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
    assert json.loads((tmp_path / "out" / "detection.json").read_text())["episodes"] == []


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


def test_files_that_cannot_be_read_are_told(sightline, tmp_path):
    for path, sentence in ((tmp_path / "none.csv", "cannot be read"), (tmp_path, "cannot be read")):
        ended = sightline("detect", path, *TEXTS)
        assert (ended.code, sentence in ended.stderr) == (2, True)
    (tmp_path / "latin.csv").write_bytes(b"time_s,anchor_id,range_m\n1,\xff\xfe,5\n")
    ended = sightline("detect", tmp_path / "latin.csv", *TEXTS)
    assert (ended.code, "is not UTF-8 text" in ended.stderr) == (2, True)


def test_the_console_script_knows_it():
    run = subprocess.run(
        [sys.executable, "-m", "service.cli", "detect", "--help"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0
    assert "LOG.csv" in run.stdout
