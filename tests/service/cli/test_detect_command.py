"""``sightline detect``: a log of ranges to a table and files; bad logs end with exit code 2 and one sentence."""

import csv
import json
import math
import subprocess
import sys

import numpy as np
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
    assert "1 occlusion" in said


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
    summary = ended.told()
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
    "another name": ("time_s,anchor_id,metres\n1,D1,5\n", "--columns time_s=time_s,anchor_id=anchor_id,range_m=…"),
    "two ranges": ("time_s,anchor_id,range,range_calib\n1,D1,5,6\n", "range_m may be 'range' or 'range_calib'"),
    "two anchors": ("time_s,anchor,beacon,range\n1,D1,D2,6\n", "anchor_id may be 'anchor' or 'beacon'"),
    "day or month": ("time,id,range\n03/04/2024 10:00:00,D1,5\n", "say --date-order dmy or mdy"),
    "no header": ("0,D1,5.5\n1,D1,6.5\n", "--columns time_s=…,anchor_id=…,range_m=…"),
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
    ended.refused(sentence)


BAD_LINES = [
    ([], "At least one anchor is needed"),
    ([*TEXTS, "--anchor", "D1,1,2,3msl"], "Anchor ids must be unique; repeated: D1"),
    (["--anchor", "D1,1,2"], "is not of the form ID,EAST,NORTH,HEIGHT with HEIGHT like 612msl"),
    (["--anchor", "D1,1,2,80agl"], "Anchor D1: a detector knows no ground"),
    (["--anchors", "missing.csv"], "cannot be read"),
    ([*TEXTS, "--tolerance", "0"], "--tolerance must be a number > 0"),
    ([*TEXTS, "--tolerance", "-1"], "--tolerance must be a number > 0"),
    ([*TEXTS, "--range-sigma", "nan"], "Invalid value for '--range-sigma': 'nan' is no number"),
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
    ended.refused(sentence)


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
