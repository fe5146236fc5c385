"""Logs as they should not be, through ``navigate`` and ``baseline``: one sentence each, nothing that is not finite."""

import csv
import json

import numpy as np
import pytest

from gnss.differential import read_orbits
from tests.gnss.differential import world
from tests.gnss.differential.test_precise_orbits import sp3_text

STEP_S, SECONDS, G = 0.02, 20.0, 9.81


def rows(**changes):
    """(n, 7) times, forces up, no turning: a vehicle that stands still; changes by name."""
    times = changes.get("times", np.arange(0.0, SECONDS, STEP_S))
    table = np.zeros((len(times), 7))
    table[:, 0], table[:, 3] = times, changes.get("up", G)
    return table


@pytest.fixture
def navigated(tmp_path, sightline):
    """navigated(table, fixes=…, settings=…, columns=…): the command over a log of those readings."""

    def run(table, fixes=None, settings=None, columns="acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"):
        lines = [",".join(repr(float(one)) for one in row) for row in table]
        (tmp_path / "imu.csv").write_text("\n".join([f"time_s,{columns}", *lines]))
        told = [(t, 500.0, 600.0, 100.0, 2.0, 3.0) for t in np.arange(0.0, SECONDS, 1.0)] if fixes is None else fixes
        head = "time_s,east_m,north_m,altitude_m,horizontal_sigma_m,vertical_sigma_m"
        (tmp_path / "gnss.csv").write_text("\n".join([head, *(",".join(map(str, one)) for one in told)]))
        words = ["navigate", tmp_path / "imu.csv", tmp_path / "gnss.csv", "--lat", 46.0, "--json"]
        (tmp_path / "settings.json").write_text(json.dumps({"heading_deg": 0.0, **(settings or {})}))
        return sightline(*words, "--settings", tmp_path / "settings.json", "--out", tmp_path / "out")

    return run


def test_gaps_repeated_times_and_saturated_axes_are_told_and_what_is_written_is_finite(navigated, tmp_path):
    table = rows()
    table[700:710, 1] = 500.0
    table = np.concatenate([table[:200], table[400:600], table[599:]])
    told = navigated(table, settings={"imu": "ADIS16405"}).told()
    said = " ".join(told["warnings"])
    for words in ("Gaps of more than", "repeat a time", "Saturated readings: 10"):
        assert words in said
    for row in csv.DictReader((tmp_path / "out" / "track.csv").read_text().splitlines()):
        numbers = [
            float(value) for value in row.values() if value and value.replace("-", "").replace(".", "").isdigit()
        ]
        assert np.isfinite(numbers).all()
        assert abs(float(row["east_m"]) - 500.0) < 30.0


BAD = {
    "are in g, it seems": {"table": rows(up=1.0)},
    "are in degrees, it seems": {"table": rows() + np.array([0, 0, 0, 0, 40.0, 0, 0])},
    "axes='frd' would fit": {"table": rows(up=-G)},
    "axes='flu' would fit": {"table": rows(), "settings": {"axes": "frd"}},
    "the unit's x axis points up": {"table": rows()[:, [0, 3, 1, 2, 4, 5, 6]]},
    "axes are three letters": {"table": rows(), "settings": {"axes": "forward"}},
    "goes backwards": {"table": rows(times=np.r_[np.arange(0.0, 10.0, STEP_S), np.arange(5.0, 10.0, STEP_S)])},
    "fix_sigma_m": {"table": rows(), "settings": {"fix_sigma_m": [1.0, 0.0, 1.0]}},
    "position_sigma_m": {"table": rows(), "settings": {"position_sigma_m": -1.0}},
}


@pytest.mark.parametrize("sentence", BAD)
def test_what_cannot_be_is_one_sentence(navigated, sentence):
    case = dict(BAD[sentence])
    navigated(case.pop("table"), **case).refused(sentence)


def test_seconds_of_a_gps_week_that_begin_anew_go_on(navigated):
    times = np.arange(0.0, SECONDS, STEP_S) + 604_790.0
    fixes = [((t + 604_790.0) % 604_800.0, 500.0, 600.0, 100.0, 2.0, 3.0) for t in np.arange(0.0, SECONDS, 1.0)]
    told = navigated(rows(times=times % 604_800.0), fixes=fixes).told()
    assert any("a week was added" in one for one in told["warnings"])
    position = next(one for one in told["sources"] if one["source"] == "position")
    assert position["used"] == position["measurements"] == 60


def test_sigmas_that_are_none_are_told(navigated):
    fixes = [(t, 500.0, 600.0, 100.0, sigma, 3.0) for t, sigma in ((0.0, -2.0), (5.0, 0.0), (10.0, 2.0))]
    told = navigated(rows(), fixes=fixes).told()
    assert any(one.startswith("Sigmas of fixes that are not above zero: 2") for one in told["warnings"])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Rover, base and orbits of a minute, made up and exact."""
    folder, rng = tmp_path_factory.mktemp("pair"), np.random.default_rng(3)
    for name in ("rover", "base"):
        told = world.heard([world.base_m()] * 4, rng)
        (folder / f"{name}.obs").write_text(world.observation_text(told, world.base_m()))
    (folder / "made.nav").write_text(world.navigation_text())
    return folder


def test_observations_that_are_cut_short_are_one_sentence(files, tmp_path, sightline):
    whole = (files / "rover.obs").read_text().splitlines()
    (tmp_path / "cut.obs").write_text("\n".join(whole[:-2]))
    words = ("baseline", tmp_path / "cut.obs", "--base", files / "base.obs", "--orbits", files / "made.nav")
    sightline(*words).refused("cut.obs")


def test_precise_orbits_of_another_day_are_one_sentence(files, tmp_path, sightline):
    orbits = read_orbits(files / "made.nav")
    middle_s = (orbits.first_s + orbits.last_s) / 2.0
    text = sp3_text(orbits, ["G07"], middle_s)
    (tmp_path / "other.sp3").write_text(text.replace("2016 ", "2017 ").replace("2015 ", "2017 "))
    words = ("baseline", files / "rover.obs", "--base", files / "base.obs", "--orbits", files / "made.nav")
    sightline(*words, "--orbits", tmp_path / "other.sp3").refused("of different days")
