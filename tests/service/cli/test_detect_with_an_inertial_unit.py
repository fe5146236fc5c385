"""sightline detect --estimator inertial: readings of a log go through the filter of a session with an inertial unit."""

import csv
import json
import math

import numpy as np
import pytest

from tests.navigation.drives.test_riding import ANCHORS, HZ, place_m, readings

SILENT = range(14, 20)
PLACED = [word for one in ANCHORS for word in ("--anchor", f"{one.id},{one.east_m},{one.north_m},{one.altitude_m}msl")]


def drive(until_s=20):
    """(rows of ranges, rows of readings, lines of epochs) on the circle, at whose end one anchor alone is heard."""
    ranges, felt, epochs = ["time_s,anchor_id,range_m"], ["time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"], []
    for second in range(1, until_s + 1):
        times_s, forces, rates = readings(second, np.random.default_rng(second))
        heard = [(one.id, math.dist((one.east_m, one.north_m, one.altitude_m), place_m(second))) for one in ANCHORS]
        heard = heard[:1] if second in SILENT else heard
        ranges += [f"{second},{name},{range_m:.4f}" for name, range_m in heard]
        rows = np.column_stack([times_s, forces, rates])
        felt += [",".join(f"{value:.6f}" for value in row) for row in rows.tolist()]
        imu = {"times_s": times_s.tolist(), "forces": forces.tolist(), "rates": rates.tolist()}
        told = [{"anchor_id": name, "range_m": range_m} for name, range_m in heard]
        epochs.append(json.dumps({"time_s": float(second), "ranges": told, "imu": imu}))
    return ranges, felt, epochs


@pytest.fixture
def tables(tmp_path):
    paths = {name: tmp_path / f"{name}.csv" for name in ("ranges", "felt")}
    for path, rows in zip(paths.values(), drive(), strict=False):
        path.write_text("\n".join(rows) + "\n")
    settings = tmp_path / "unit.json"
    settings.write_text(json.dumps({"imu": "tactical", "heading_deg": 0.0}))
    return paths["ranges"], paths["felt"], settings


def last_place_m(folder):
    with (folder / "estimates.csv").open(newline="") as stream:
        last = list(csv.DictReader(stream))[-1]
    assert float(last["time_s"]) == 20.0
    return [float(last[name]) for name in ("east_m", "north_m", "altitude_m")]


def test_the_readings_of_another_table_lead_it_through_silence(sightline, tables, tmp_path):
    ranges, felt, settings = tables
    off_m = []
    for name, more in (
        ("inertial", ["--imu-log", felt, "--settings", settings]),
        ("constant_velocity", []),
    ):
        words = ["--max-speed", "3", "--estimator", name, *more, "--out", tmp_path / name]
        told = sightline("detect", ranges, *PLACED, *words)
        assert told.code == 0, told.stderr
        off_m.append(math.dist(last_place_m(tmp_path / name), place_m(20)))
    assert off_m[0] < 1.0
    assert off_m[0] < 0.3 * off_m[1]
    document = json.loads((tmp_path / "inertial" / "detection.json").read_text())
    assert document["imu"]["readings"] == document["imu"]["used"] == 20 * HZ
    assert document["imu"]["riding"] >= 18


def test_readings_in_the_epochs_of_a_stream_are_taken_and_told_where_nothing_takes_them(sightline, tmp_path):
    log = tmp_path / "epochs.jsonl"
    log.write_text("\n".join(drive(8)[2]) + "\n")
    asked = ["detect", log, *PLACED, "--max-speed", "3", "--json"]
    plain = json.loads(sightline(*asked).stdout)
    assert "8 epochs hold inertial readings, which only --estimator inertial takes." in plain["warnings"]
    led = sightline(*asked, "--estimator", "inertial", "--out", tmp_path / "out")
    assert led.code == 0, led.stderr
    assert json.loads(led.stdout)["imu"]["used"] == 8 * HZ


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--settings", "SETTINGS"], "--imu-log, --settings and --lat go with --estimator inertial."),
        (["--estimator", "inertial"], "is inertial readings"),
        (["--estimator", "inertial", "--imu-log", "LATER"], "No inertial reading is of the time of the ranges"),
        (["--estimator", "inertial", "--imu-log", "FELT", "--lat", 95], "and its latitude within ±90°."),
    ],
)
def test_what_does_not_fit_is_one_sentence(sightline, tables, tmp_path, words, sentence):
    ranges, felt, settings = tables
    later = tmp_path / "later.csv"
    head, *rows = felt.read_text().splitlines()
    later.write_text("\n".join([head, *(f"9{row}" for row in rows)]))
    given = [{"SETTINGS": settings, "LATER": later, "FELT": felt}.get(word, word) for word in words]
    told = sightline("detect", ranges, *PLACED, *given, "--out", tmp_path / "out")
    assert told.code == 2
    assert sentence in " ".join(told.stderr.split())
    assert not (tmp_path / "out").exists()


def test_settings_of_no_use_here_are_told(sightline, tables, tmp_path):
    ranges, felt, settings = tables
    settings.write_text(json.dumps({"heading_deg": 0.0, "smoother": False}))
    words = ["--estimator", "inertial", "--imu-log", felt, "--settings", settings, "--out", tmp_path / "out", "--json"]
    told = json.loads(sightline("detect", ranges, *PLACED, *words).stdout)
    assert "Of the settings smoother are of no use here; navigate takes them." in told["warnings"]
