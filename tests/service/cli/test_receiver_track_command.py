"""``sightline receiver track``: channels along a known trajectory, files, what a map hides, and bad input."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from gnss import ephemeris_positions_ecef_m, instants, look_angles
from gnss.sky import place_of_ecef
from terrain import ElevationGrid, write_npz
from tests.gnss.differential import world
from tests.gnss.receiver import recordings
from tests.reference import gps_signals

# those in the north are behind the wall of a map
NAMES = world.in_sight()
STRENGTHS = dict(zip(NAMES[:6], (46.0, 45.0, 44.0, 43.0, 42.0, 41.0), strict=True))
TIME = world.START.utc().isoformat()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("recording")
    values, _ = recordings.recorded(STRENGTHS, 0.4)
    np.round(30.0 * values.astype(np.complex64).view(np.float32)).clip(-128, 127).astype(np.int8).tofile(
        place / "drive.bin"
    )
    (place / "sky.nav").write_text(world.navigation_text())
    times_s = np.arange(-1.0, 4.0, 0.5)
    places_m = recordings.antenna_m(times_s)
    np.savetxt(place / "circle.csv", np.column_stack([times_s, places_m]), delimiter=",", fmt="%.4f")
    lon_lat_m = [(one.lon_deg, one.lat_deg, one.height_m) for one in map(place_of_ecef, places_m)]
    table = np.column_stack([times_s, lon_lat_m, np.zeros((len(times_s), 3)), np.arange(len(times_s))])
    names = "time_s,lon_deg,lat_deg,height_m,heading_deg,pitch_deg,roll_deg,number"
    np.savetxt(place / "turned.csv", table, delimiter=",", fmt="%.10f", header=names, comments="")
    return place


def words(folder, *more, samples="drive.bin"):
    read = ("--rate", recordings.RATE_HZ, "--type", "int8", "--mask", "15")
    aided = ("--navigation", folder / "sky.nav", "--time", TIME, "--trajectory", folder / "circle.csv")
    return ("receiver", "track", folder / samples, *read, *aided, *more)


def test_it_measures_what_is_there_and_writes_it(folder, tmp_path, sightline):
    told = sightline(*words(folder, "--out", tmp_path / "out", "--json")).told()
    found = {one["prn"]: one for one in told["satellites"]}
    assert set(found) == {int(name[1:]) for name in NAMES}
    for name in NAMES:
        one = found[int(name[1:])]
        assert (one["detected"], one["intervals"]) == ((1, 1) if name in STRENGTHS else (0, 1)), name
        assert one["integration_s"] == pytest.approx(0.38, abs=0.011), "of the 0.4 s that the file lasts"
        if name in STRENGTHS:
            assert one["cn0_db_hz"] == pytest.approx(STRENGTHS[name], abs=2.0)
    assert told["clock_s"] == pytest.approx(recordings.OFFSET_S, abs=4e-7)
    assert len(told["acquired"]) >= 2
    with (tmp_path / "out" / "channels.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["detected"] == "1"]
    assert len(rows) == len(STRENGTHS)
    for row in rows:
        (truth_s,) = recordings.true_delays(f"G{int(row['prn']):02d}", np.array([float(row["time_s"])]))
        assert float(row["pseudorange_m"]) == pytest.approx(
            world.LIGHT * truth_s, abs=4.0 * float(row["pseudorange_sigma_m"]) + 2.0
        )
        assert len(row["bits"]) == round(float(row["integration_s"]) / 0.02)
    assert json.loads((tmp_path / "out" / "receiver.json").read_text()) == told


def test_a_table_is_what_people_see_and_a_clock_may_be_given(folder, sightline):
    shown = sightline(*words(folder, "--clock", recordings.OFFSET_S, "--clock-drift", recordings.DRIFT))
    assert shown.code == 0, shown.stderr
    assert "123.400 µs, as told" in shown.stdout
    assert "1 of 1" in shown.stdout


def test_what_the_map_hides_is_not_looked_for_and_trees_make_channels_sum_longer(folder, tmp_path, sightline):
    heights = np.zeros((61, 61), np.float32)
    heights[:20] = 3000.0  # a wall in the north, 500 m away
    grid = ElevationGrid(heights, 50.0, 50.0, 462_000.0 - 1500.0, 5_205_300.0 + 1500.0, "EPSG:32632")
    write_npz(grid, tmp_path / "wall.npz")
    told = sightline(*words(folder, "--dem", tmp_path / "wall.npz", "--canopy-height", "20", "--json")).told()
    found = {one["prn"]: one for one in told["satellites"]}
    seen = look_angles(world.PLACE, ephemeris_positions_ecef_m(world.ORBITS, NAMES, instants(world.START))[:, 0])
    checked = set()
    for name, azimuth, elevation in zip(NAMES, seen.azimuth_rad, seen.elevation_rad, strict=True):
        one, northward = found[int(name[1:])], np.cos(azimuth)
        # the wall rises by 3000 m over 500 m to the north
        rises = np.arctan(3000.0 / 550.0 * northward)
        if abs(elevation - max(rises, 0.0)) < 0.1:
            continue
        behind = northward > 0.0 and elevation < rises
        assert one["hidden"] == behind, name
        assert (one["intervals"] == 0) == behind
        checked.add(behind)
        if not behind:
            # Weissberger over 20 m / sin(elevation), less what the antenna's 2 m take
            way_m = 18.0 / np.sin(elevation)
            loss_db = 1.33 * 1.57542**0.284 * way_m**0.588 if way_m > 14.0 else 0.45 * 1.57542**0.284 * way_m
            assert one["expected_loss_db"] == pytest.approx(loss_db, rel=0.05)
            assert one["integration_s"] >= 0.02
    assert checked == {True, False}
    assert max(one["integration_s"] for one in told["satellites"]) > 0.05


def test_a_lever_arm_moves_the_antenna(folder, sightline):
    moved = words(folder, "--trajectory", folder / "turned.csv", "--lever-arm", "0,0,3000")
    ranges_m = []
    for more in ((), ("--lever-arm", "0,0,300")):
        told = sightline(*words(folder, *more, "--json", "--trajectory", folder / "turned.csv")).told()
        assert "not used: number" in told["warnings"][0]
        ranges_m.append(told["clock_s"] * world.LIGHT)
    # 300 m higher all satellites are nearer, which only the clock can take
    assert 50.0 < ranges_m[1] - ranges_m[0] < 300.0
    sightline(*moved[:-2], "--lever-arm", "1,2").refused("--lever-arm '1,2' is not of the form FORWARD,LEFT,UP")


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (("--trajectory", "none.csv"), "The trajectory 'none.csv' cannot be read"),
        (("--at", "8.5,47,500"), "one of --trajectory and --at"),
        (("--time", "yesterday"), "is no ISO 8601 time"),
        (("--time", "2016-01-02T00:00:00Z"), "No ephemeris"),
        (("--prn", "31"), "no healthy ephemeris of G31"),
        (("--prn", "x"), "--prn takes numbers"),
        (("--mask", "89"), "No satellite is left to look for"),
        (("--seconds", "5"), "drive.bin is truncated"),
        (("--seconds", "0.04", "--clock", "0"), "No satellite of"),
        (("--rate", "1e6"), "A C/A signal needs"),
        (("--rate", "4.2e6"), "are start, place, rate and type right?"),
        (("--type", "complex64"), "of another type?"),
        (("--clock", "5e-3"), "No satellite of"),
        (("--clock-drift", "1e-6"), "--clock-drift goes with --clock"),
        (("--integration", "2"), "whole bits of 20 ms"),
        (("--integration", "0"), "whole bits of 20 ms"),
        (("--integration", "0.03"), "whole bits of 20 ms"),
        (("--start", "3"), "drive.bin lasts 0.4 s; there is nothing from 3 s on."),
        (("--integration", "nan", "--seconds", "0.1"), "Invalid value for '--integration': 'nan' is no number"),
        (("--seconds", "0"), "the duration and the rate above zero"),
        (("--clock", "nan"), "Invalid value for '--clock': 'nan' is no number"),
        (("--reach", "1e9", "--seconds", "0.1"), "a reach of 0 to 25 Hz"),
        (("--antenna-height", "3"), "go with --dem"),
        (("--lever-arm", "1,0,0"), "A lever arm needs heading_deg"),
    ],
)
def test_bad_input_is_one_sentence(folder, sightline, more, sentence):
    sightline(*words(folder, *more)).refused(sentence)


def test_samples_that_are_cut_clipped_or_noise_are_told(folder, tmp_path, sightline):
    (tmp_path / "sky.nav").write_text(world.navigation_text())
    (tmp_path / "circle.csv").write_bytes((folder / "circle.csv").read_bytes())
    whole = np.fromfile(folder / "drive.bin", np.int8)
    (tmp_path / "cut.bin").write_bytes(whole.tobytes()[:-1])
    told = sightline(*words(tmp_path, "--json", samples="cut.bin")).told()
    assert told["warnings"] == ["cut.bin ends in the middle of a sample; its last bytes are left out."]
    (tmp_path / "loud.bin").write_bytes(np.clip(60 * whole.astype(int), -128, 127).astype(np.int8).tobytes())
    sightline(*words(tmp_path, samples="loud.bin")).refused("loud.bin is clipped")
    noise = gps_signals.noise(np.random.default_rng(4), 210_000).astype(np.complex64).view(np.float32)
    (tmp_path / "noise.bin").write_bytes(np.round(30.0 * noise).clip(-128, 127).astype(np.int8).tobytes())
    sightline(*words(tmp_path, samples="noise.bin")).refused("0 of the", "are start, place, rate and type right?")
    (tmp_path / "bad.csv").write_text("time_s,x_m,y_m\n0,1,2\n")
    placeless = sightline(*words(tmp_path, "--trajectory", tmp_path / "bad.csv", samples="noise.bin"))
    placeless.refused("has no column", "or lon_deg, lat_deg, height_m.")
