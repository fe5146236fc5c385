"""Heights and places leave for other programs as what those take them for, or not at all."""

import json
import math

import gpxpy
import pyproj
import pytest

from terrain import ElevationGrid, egm96_height_m, height_at, to_grid_frame, to_lon_lat, write_npz
from tests.service.cli.height_questions import (
    ELLIPSOID,
    FLY,
    GEOID,
    MOON,
    MOVE,
    PLACE,
    geoid_m,
    items_of,
    plan,
    written,
)
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, NORTH_M, WEST_M, small_grid


def test_heights_from_the_sea_leave_as_they_are(sightline, dem, tmp_path):
    told, names = written(sightline, dem(GEOID), PLACE, tmp_path / "out")
    assert {"plans.zip", "beacons.parm"} <= names
    altitudes_m = {anchor["altitude_m"] for anchor in told["placed"]}
    assert {item["Altitude"] for item in items_of(tmp_path / "out")} == altitudes_m
    assert {(item["frame"], item["AltitudeMode"]) for item in items_of(tmp_path / "out")} == {(0, 2)}
    assert not any("plans.zip" in warning for warning in told["warnings"])


def test_heights_from_the_ellipsoid_leave_as_above_the_sea(sightline, dem, tmp_path):
    told, names = written(sightline, dem(ELLIPSOID), PLACE, tmp_path / "out")
    assert {"plans.zip", "beacons.parm"} <= names
    above_sea_m = sorted(anchor["altitude_m"] - geoid_m(anchor) for anchor in told["placed"])
    assert max(abs(geoid_m(anchor)) for anchor in told["placed"]) > 30.0
    hover_m = sorted({round(item["Altitude"], 6) for item in items_of(tmp_path / "out")})
    assert hover_m == pytest.approx(above_sea_m, abs=1e-3)
    assert {(item["frame"], item["AltitudeMode"]) for item in items_of(tmp_path / "out")} == {(0, 2)}
    settings = dict(
        line.split(",") for line in (tmp_path / "out" / "beacons.parm").read_text().splitlines() if line[0] != "#"
    )
    first = told["placed"][0]
    ground_m = first["altitude_m"] - first["above_ground_m"]
    assert float(settings["BCN_ALT"]) == pytest.approx(ground_m - geoid_m(first), abs=0.006)
    (said,) = (warning for warning in told["warnings"] if "plans.zip" in warning)
    assert said == (
        "plans.zip, beacons.parm and anchors.kml give altitudes above mean sea level: the DEM's, from the ellipsoid, "
        "less EGM96."
    )


@pytest.mark.parametrize("datum", ["made up", None])
def test_placed_drones_hover_above_the_ground_where_no_sea_level_is_known(sightline, dem, tmp_path, datum):
    told, names = written(sightline, dem(datum), PLACE, tmp_path / "out")
    assert "beacons.parm" not in names
    items = items_of(tmp_path / "out")
    # MAV_FRAME_GLOBAL_TERRAIN_ALT, which QGroundControl calls mode 4: "0 being at ground level in terrain model"
    assert {(item["frame"], item["AltitudeMode"], item["Altitude"]) for item in items} == {(10, 4, 40.0)}
    assert all(item["params"][6] == 40.0 for item in items)
    said = " ".join(told["warnings"])
    assert "beacons.parm is not written" in said
    assert "plans.zip gives heights above the ground" in said


def test_terrain_frames_are_written_where_asked(sightline, dem, tmp_path):
    written(sightline, dem(GEOID), (*PLACE, "--terrain-frame"), tmp_path / "out")
    items = items_of(tmp_path / "out")
    assert {(item["frame"], item["AltitudeMode"], item["Altitude"]) for item in items} == {(10, 4, 40.0)}
    written(sightline, dem(GEOID), (*plan(), "--terrain-frame"), tmp_path / "path")
    assert {(item["frame"], item["Altitude"]) for item in items_of(tmp_path / "path", "path.plan")} == {(10, 0.0)}


@pytest.mark.parametrize(("question", "file"), [(FLY, "flight.plan"), (MOVE, "plans.zip")])
def test_flights_leave_as_above_the_sea_or_not_at_all(sightline, dem, tmp_path, question, file):
    told, names = written(sightline, dem(None), question, tmp_path / "unknown")
    assert file not in names
    (said,) = (warning for warning in told["warnings"] if f"{file} is not written" in warning)
    assert said.endswith("Read it with vertical_datum (EGM96, hae).")
    told, names = written(sightline, dem(GEOID), question, tmp_path / "sea")
    assert file in names
    assert not any(file in warning for warning in told["warnings"])
    _, names = written(sightline, dem(ELLIPSOID), question, tmp_path / "ellipsoid")
    assert file in names
    pairs = zip(items_of(tmp_path / "sea", file), items_of(tmp_path / "ellipsoid", file), strict=True)
    lifts_m = [below["Altitude"] - above["Altitude"] for above, below in pairs]
    # the same numbers, once above a geoid that lies some 34 m below the ellipsoid, once above the ellipsoid
    assert min(lifts_m) > 33.0
    assert max(lifts_m) < 35.0


def test_who_says_what_heights_count_from_gets_the_files(sightline, dem, tmp_path):
    told, names = written(sightline, dem(None), (*FLY, "--vertical-datum", "EGM96"), tmp_path / "out")
    assert "flight.plan" in names
    assert told["dem"]["vertical_datum"] == "EGM96 geoid"
    assert any("vertical_datum= says: EGM96 geoid" in one for one in told["dem"]["conversions"])


def test_a_track_has_elevations_above_the_sea_or_none(sightline, dem, tmp_path):
    told, names = written(sightline, dem(None), plan(), tmp_path / "unknown")
    assert {"path.gpx", "path.plan"} <= names
    track = gpxpy.parse((tmp_path / "unknown" / "path.gpx").read_text())
    assert {point.elevation for point in track.tracks[0].segments[0].points} == {None}
    assert {(item["frame"], item["Altitude"]) for item in items_of(tmp_path / "unknown", "path.plan")} == {(10, 0.0)}
    assert any("path.gpx has no altitudes" in warning for warning in told["warnings"])
    told, _ = written(sightline, dem(ELLIPSOID), plan(), tmp_path / "ellipsoid")
    track = gpxpy.parse((tmp_path / "ellipsoid" / "path.gpx").read_text())
    line = json.loads((tmp_path / "ellipsoid" / "path.geojson").read_text())["features"][0]
    for point, place in zip(track.tracks[0].segments[0].points, line["geometry"]["coordinates"], strict=True):
        below_m = float(egm96_height_m(*place[:2]))
        assert point.elevation == pytest.approx(height_under(place) - below_m, abs=0.02)


def height_under(place):
    grid = small_grid("EPSG:32611")
    return float(height_at(grid, *to_grid_frame(grid, *place[:2])))


@pytest.mark.parametrize("question", [PLACE, plan(1.2e6)], ids=["place", "plan"])
def test_nothing_on_the_moon_is_written_for_the_earth(sightline, dem, tmp_path, question):
    told, names = written(sightline, dem(None, MOON), question, tmp_path / "out")
    assert names.isdisjoint({"plans.zip", "beacons.parm", "path.gpx", "path.plan"})
    assert any("lies on the Moon" in warning for warning in told["warnings"])
    (name,) = (name for name in names if name.endswith(".geojson"))
    document = json.loads((tmp_path / "out" / name).read_text())
    assert document["body"] == "Moon"
    assert "Moon" in document["coordinates_are"]
    assert "clockwise of true north" in document["azimuths_are"]


def test_a_files_moon_is_not_the_earth(sightline, dem, tmp_path):
    moon = dem(None, MOON)
    written(sightline, moon, PLACE, tmp_path / "out")
    anchors = "--anchors", tmp_path / "out" / "anchors.geojson"
    again = sightline("visibility", moon, *anchors, "--json")
    assert again.code == 0, again.stderr
    ended = sightline("visibility", dem(None), *anchors)
    assert ended.code == 2
    assert ended.stderr == "Longitude and latitude on Moon have no place on a DEM of Earth.\n"


def test_a_local_frame_has_no_missions(sightline, dem, tmp_path):
    _, names = written(sightline, dem(None, None), PLACE, tmp_path / "out")
    assert "anchors.geojson" in names
    assert names.isdisjoint({"plans.zip", "beacons.parm"})


def test_beacons_are_where_the_anchors_are(sightline, tmp_path):
    """As AP_Beacon_Backend places them: offsets turned by BCN_ORIENT_YAW, which holds whole degrees, into NED."""
    there = pyproj.Transformer.from_crs(4326, 32632, always_xy=True).transform(14.4, 64.0)  # 5.4° off the meridian
    small = small_grid("EPSG:32632")
    heights_m = small.heights_m.repeat(3, axis=0).repeat(3, axis=1)
    grid = ElevationGrid(heights_m, CELL_EAST_M, CELL_NORTH_M, *there, crs="EPSG:32632", vertical_datum=GEOID)
    write_npz(grid, tmp_path / "north.npz")
    told, _ = written(sightline, tmp_path / "north.npz", ("place", "--count", 3, *PLACE[3:]), tmp_path / "out")
    lines = (tmp_path / "out" / "beacons.parm").read_text().splitlines()
    settings = dict(line.split(",") for line in lines if not line.startswith("#"))
    yaw_deg = float(settings["BCN_ORIENT_YAW"])
    assert yaw_deg == int(yaw_deg)
    turn = math.radians(yaw_deg)
    geod = pyproj.Geod(ellps="WGS84")
    offsets = [[float(v) for v in line.split(": ")[1].split(", ")] for line in lines if line.startswith("# beacon")]
    for anchor, (along_m, across_m, down_m) in zip(told["placed"], offsets, strict=True):
        north_m = along_m * math.cos(turn) - across_m * math.sin(turn)
        east_m = along_m * math.sin(turn) + across_m * math.cos(turn)
        lon, lat, _ = geod.fwd(
            float(settings["BCN_LONGITUDE"]),
            float(settings["BCN_LATITUDE"]),
            math.degrees(math.atan2(east_m, north_m)),
            math.hypot(east_m, north_m),
        )
        assert geod.inv(lon, lat, *to_lon_lat(grid, anchor["east_m"], anchor["north_m"]))[2] < 0.05
        assert float(settings["BCN_ALT"]) - down_m == pytest.approx(anchor["altitude_m"], abs=0.02)


@pytest.mark.parametrize("option", ["--no-go", "--keep-in"])
def test_an_area_that_touches_no_post_is_told(sightline, dem, tmp_path, option):
    half_deg = 1.0 if option == "--keep-in" else 0.0005
    lon, lat = to_lon_lat(small_grid(), WEST_M + 750.0, NORTH_M - 400.0)
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
    ring = [[lon + half_deg * east, lat + half_deg * north] for east, north in corners]
    far = {"type": "Polygon", "coordinates": [[[east + 5.0, north] for east, north in ring]]}
    near = {"type": "Polygon", "coordinates": [ring]}
    (tmp_path / "area.geojson").write_text(json.dumps({"type": "GeometryCollection", "geometries": [far, near]}))
    done = sightline(*plan()[:1], dem(GEOID), *plan()[1:], option, tmp_path / "area.geojson", "--json")
    told = [warning for warning in json.loads(done.stdout)["warnings"] if "touches no post" in warning]
    field = option.removeprefix("--").replace("-", "_")
    assert told == [f"{field}[0] touches no post of the DEM."]


def test_an_area_with_swapped_degrees_is_told_as_such(sightline, tmp_path):
    grid = ElevationGrid(small_grid().heights_m, 30.0, 20.0, *(600_000.0, 5_100_000.0), "EPSG:32632")
    write_npz(grid, tmp_path / "alps.npz")
    lon, lat = to_lon_lat(grid, 600_300.0, 5_099_800.0)
    ring = [[lat, lon], [lat, lon + 0.001], [lat + 0.001, lon], [lat, lon]]
    (tmp_path / "area.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    for option in ("--no-fly", "--stand-off"):
        file = tmp_path / "area.geojson" if option == "--no-fly" else f"{tmp_path / 'area.geojson'},5"
        done = sightline("place", tmp_path / "alps.npz", *PLACE[1:], option, file, "--json")
        assert done.code == 0, done.stderr
        (told,) = (warning for warning in json.loads(done.stdout)["warnings"] if "touches no post" in warning)
        assert "with longitude and latitude swapped it would" in told
