"""``sightline navigate``: logs to files, with and without a map, and the same answer as a request's."""

import csv
import json

import numpy as np
import pytest

from tests.service.satellite_drives import ZERO_GPS_S, drive_by_satellites
from tests.service.small_drives import drive_request, true_places_m


@pytest.fixture
def logs(tmp_path):
    """The small drive as tables, readings in g."""
    asked = drive_request()
    readings = asked["readings"]
    with (tmp_path / "imu.csv").open("w") as file:
        print("time_s,acc_x_g,acc_y_g,acc_z_g,gyro_x,gyro_y,gyro_z", file=file)
        for time_s, force, rate in zip(readings["times_s"], readings["forces"], readings["rates"], strict=True):
            print(time_s, *(one / 9.80665 for one in force), *rate, sep=",", file=file)
    with (tmp_path / "gnss.csv").open("w") as file:
        print("time_s,east_m,north_m,altitude_m,horizontal_sigma_m,vertical_sigma_m,ve,vn,vu", file=file)
        for one in asked["fixes"]:
            sigmas = one["horizontal_sigma_m"], one["vertical_sigma_m"]
            place = one["east_m"], one["north_m"], one["altitude_m"]
            print(one["time_s"], *place, *sigmas, *one["velocity_m_per_s"], sep=",", file=file)
    with (tmp_path / "ranges.csv").open("w") as file:
        print("time_s,anchor_id,range_m,sigma_m", file=file)
        for one in asked["ranges"]:
            print(one["time_s"], one["anchor_id"], one["range_m"], one["sigma_m"], sep=",", file=file)
    (tmp_path / "settings.json").write_text(json.dumps(asked["settings"]))
    anchors = [
        word
        for one in asked["anchors"]
        for word in ("--anchor", f"{one['id']},{one['east_m']},{one['north_m']},{one['altitude_m']}msl")
    ]
    return tmp_path, [tmp_path / f"{name}.csv" for name in ("imu", "gnss", "ranges")], anchors


def test_a_log_of_tables_is_navigated_as_the_same_request_is(logs, sightline, dem_file):
    folder, tables, anchors = logs
    words = ["navigate", *tables, "--dem", dem_file, "--settings", folder / "settings.json", *anchors, "--json"]
    told = sightline(*words, "--out", folder / "out").told()
    request = folder / "request.json"
    request.write_text(json.dumps(drive_request()))
    same = sightline("navigate", "--dem", dem_file, "--request", request, "--json").told()
    assert told["way_m"] == pytest.approx(same["way_m"], abs=1e-6)
    assert told["hidden_ranges"] == same["hidden_ranges"]
    assert any("in g" in one for one in told["warnings"])
    rows = list(csv.DictReader((folder / "out" / "track.csv").read_text().splitlines()))
    places_m = np.array([[float(row[name]) for name in ("east_m", "north_m", "altitude_m")] for row in rows])
    times_s = np.array([float(row["time_s"]) for row in rows])
    assert np.linalg.norm(places_m - true_places_m(times_s), axis=1).max() < 1.5


def test_without_a_map_places_are_those_of_fixes(logs, sightline):
    folder, tables, _ = logs
    ended = sightline("navigate", *tables[:2], "--lat", 34.3, "--out", folder / "out")
    assert ended.code == 0, ended.stderr
    assert (folder / "out" / "map.png").exists()
    assert not (folder / "out" / "track.gpx").exists()
    degrees = "time_s,lat_deg,lon_deg,altitude_m\n0,34.3,-118.1,500\n10,34.3,-118.1,500\n"
    tables[1].write_text(degrees)
    told = sightline("navigate", *tables[:2], "--json", "--out", folder / "out").told()
    assert told["dem"]["crs"] == "EPSG:32611"
    assert (folder / "out" / "track.gpx").exists()


def test_what_cannot_be_navigated_is_refused_in_a_sentence(logs, sightline, dem_file):
    folder, tables, anchors = logs
    sightline("navigate").refused("Missing argument 'LOG'")
    sightline("navigate", tables[0]).refused("Give fixes, ranges or satellites")
    sightline("navigate", "--request", folder / "settings.json").refused("--dem FILE")
    (folder / "broken.json").write_text('{"imu": "HG1700"}')
    sightline("navigate", *tables[:2], "--settings", folder / "broken.json").refused("settings.imu")
    (folder / "broken.json").write_text("[]")
    sightline("navigate", *tables[:2], "--settings", folder / "broken.json").refused("holds no JSON object")
    lines = tables[0].read_text().splitlines()
    tables[0].write_text("\n".join([*lines[:10], lines[3]]))
    sightline("navigate", *tables, "--dem", dem_file, *anchors).refused("goes backwards")


def test_ranges_to_anchors_that_nobody_named_are_told(logs, sightline, dem_file):
    _, tables, anchors = logs
    told = sightline("navigate", *tables, "--dem", dem_file, *anchors[2:], "--json").told()
    assert "Ranges to W were not used: no --anchor or --anchors names them." in told["warnings"]


@pytest.fixture
def heard(tmp_path):
    """Half a circle of 25 m by satellites alone: readings by seconds of the GPS week, RINEX, orbits."""
    asked = drive_by_satellites(ZERO_GPS_S % 604_800.0)
    with (tmp_path / "imu.csv").open("w") as file:
        print("time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z", file=file)
        read = asked["readings"]
        for time_s, force, rate in zip(read["times_s"], read["forces"], read["rates"], strict=True):
            print(time_s, *force, *rate, sep=",", file=file)
    (tmp_path / "rover.obs").write_text(asked["satellites"]["observations"])
    (tmp_path / "made.nav").write_text(asked["satellites"]["orbits"][0])
    return tmp_path


def test_observations_and_orbits_alone_make_a_drive(heard, sightline):
    words = ["navigate", heard / "imu.csv", "--observations", heard / "rover.obs", "--orbits", heard / "made.nav"]
    told = sightline(*words, "--json", "--out", heard / "out").told()
    assert told["way_m"] == pytest.approx(np.pi * 25.0, abs=1.5)
    assert told["dem"]["crs"] == "EPSG:32632"
    assert {one["source"] for one in told["sources"]} == {"pseudorange", "phase"}
    assert any("seconds of the GPS week" in one for one in told["warnings"])
    with (heard / "out" / "innovations.csv").open() as file:
        assert {row["source"] for row in csv.DictReader(file)} == {"pseudorange", "phase"}
    # above the sea: EGM96 is 47.6 m over the ellipsoid there, and the models of the air take some metres away
    rows = list(csv.DictReader((heard / "out" / "track.csv").read_text().splitlines()))
    assert abs(float(rows[-1]["altitude_m"]) - 452.4) < 30.0


def test_observations_that_make_no_drive_are_refused_in_a_sentence(heard, sightline):
    words = ["navigate", heard / "imu.csv", "--observations", heard / "rover.obs"]
    sightline(*words).refused("--observations needs --orbits")
    sightline("navigate", heard / "imu.csv", "--orbits", heard / "made.nav").refused("go with --observations")
    sightline(*words, "--orbits", heard / "absent.nav").refused("absent.nav")
    sightline(*words, "--orbits", heard / "rover.obs").refused("no RINEX navigation file")
    sightline(*words, "--orbits", heard / "made.nav", "--zero-gps", 5.0).refused("s from the observations")

    (heard / "settings.json").write_text('{"least_elevation_deg": 89}')
    words += ["--orbits", heard / "made.nav", "--settings", heard / "settings.json"]
    sightline(*words).refused("lower than the least elevation of 89°, 0 are hidden")


def test_a_map_that_the_drive_is_not_on_is_told_and_options_of_a_map_need_one(heard, dem_file, sightline):
    words = ["navigate", heard / "imu.csv", "--observations", heard / "rover.obs", "--orbits", heard / "made.nav"]
    off = "31 of 31 places lie off the DEM or on its unknown ground: it tells nothing there."
    assert off in sightline(*words, "--dem", dem_file, "--json").told()["warnings"]
    assert off not in sightline(*words, "--dem", dem_file, "--without-the-map", "--json").told()["warnings"]
    assert off not in sightline(*words, "--json").told()["warnings"]
    sightline(*words, "--range-sigma", 0.2).refused("--range-sigma goes with --anchor or --anchors.")
    sightline(*words, "--lonlat").refused("--lonlat goes with --anchor, --area or --around.")
    for more in (["--ask-the-map"], ["--without-the-map"], ["--dem-sigma", 5.0], ["--curvature", "flat"]):
        sightline(*words, *more).refused("--dem-sigma and --curvature go with --dem.")
