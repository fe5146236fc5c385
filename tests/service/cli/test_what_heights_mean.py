"""Heights and places leave for other programs as what those take them for, or not at all; and so they come in."""

import json
import math
import zipfile
from dataclasses import replace

import gpxpy
import pyproj
import pytest

from terrain import ElevationGrid, to_lon_lat, write_npz
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, NORTH_M, WEST_M, small_grid

ELLIPSOID, GEOID = "ellipsoid of WGS 84", "EGM2008 height"
MOON = (
    'PROJCRS["Moon",BASEGEOGCRS["Moon",DATUM["Moon",ELLIPSOID["Moon",1737400,0]]],CONVERSION["Moon",'
    'METHOD["Transverse Mercator"],PARAMETER["Latitude of natural origin",0],'
    'PARAMETER["Longitude of natural origin",30],PARAMETER["Scale factor at natural origin",1],'
    'PARAMETER["False easting",400000],PARAMETER["False northing",0]],CS[Cartesian,2],AXIS["(E)",east],'
    'AXIS["(N)",north],LENGTHUNIT["metre",1]]'
)


@pytest.fixture
def dem(tmp_path):
    """A function that writes the small ground with heights that count from somewhere, in a CRS."""

    def write(datum, crs="EPSG:32611"):
        path = tmp_path / "ground.npz"
        grid = replace(small_grid(crs), vertical_datum=datum)
        if crs == MOON:
            grid = replace(grid, origin_north_m=1.2e6)
        write_npz(grid, path)
        return path

    return write


def at(east_m, south_m, height=None, north_m=NORTH_M):
    place = f"{WEST_M + east_m},{north_m - south_m}"
    return place if height is None else f"{place},{height}"


PLACE = ("place", "--count", 2, "--spacing", 150, "--height", "40agl", "--min-anchors", 1)
FLY = ("fly", "--start", at(100, 400, "60agl"), "--goal", at(750, 70, "90agl"), "--iterations", 2000)
MOVE = (
    *("reposition", "--anchor", f"D1,{at(700, 60, '30agl')}", "--anchor", f"D2,{at(100, 200, '30agl')}"),
    *("--anchor", f"D3,{at(780, 300, '30agl')}", "--rover", at(640, 380), "--heading", 20, "--ahead", 120),
    *("--min-anchors", 2, "--height", 60, "--occluded", "D1"),
)


def plan(north_m=NORTH_M):
    ends = "--start", at(45, 430, north_m=north_m), "--goal", at(470, 70, north_m=north_m)
    return ("plan", *ends, "--no-sampling")


def written(sightline, path, question, out):
    """(the summary, the names of the files) of a command with --out."""
    done = sightline(question[0], path, *question[1:], "--out", out, "--json")
    assert done.code == 0, done.stderr
    return json.loads(done.stdout), {file.name for file in out.iterdir()}


def items_of(out, name="plans.zip"):
    if name != "plans.zip":
        return json.loads((out / name).read_text())["mission"]["items"]
    with zipfile.ZipFile(out / name) as plans:
        return [item for one in plans.namelist() for item in json.loads(plans.read(one))["mission"]["items"]]


@pytest.mark.parametrize("datum", [GEOID, "made up", None])
def test_heights_from_the_sea_or_from_who_knows_where_leave_as_they_are(sightline, dem, tmp_path, datum):
    told, names = written(sightline, dem(datum), PLACE, tmp_path / "out")
    assert {"plans.zip", "beacons.parm"} <= names
    altitudes_m = {anchor["altitude_m"] for anchor in told["placed"]}
    assert {item["Altitude"] for item in items_of(tmp_path / "out")} == altitudes_m
    assert {(item["frame"], item["AltitudeMode"]) for item in items_of(tmp_path / "out")} == {(0, 2)}
    assert any("above mean sea level" in warning for warning in told["warnings"]) == (datum != GEOID)


def test_placed_drones_hover_above_the_ground_where_no_sea_level_is_known(sightline, dem, tmp_path):
    told, names = written(sightline, dem(ELLIPSOID), PLACE, tmp_path / "out")
    assert "beacons.parm" not in names
    items = items_of(tmp_path / "out")
    # MAV_FRAME_GLOBAL_TERRAIN_ALT, which QGroundControl calls mode 4: "0 being at ground level in terrain model"
    assert {(item["frame"], item["AltitudeMode"], item["Altitude"]) for item in items} == {(10, 4, 40.0)}
    assert all(item["params"][6] == 40.0 for item in items)
    said = " ".join(told["warnings"])
    assert "beacons.parm is not written" in said
    assert "plans.zip gives heights above the ground" in said


@pytest.mark.parametrize(("question", "file"), [(FLY, "flight.plan"), (MOVE, "plans.zip")])
def test_flights_over_the_ground_are_not_written_as_above_the_sea(sightline, dem, tmp_path, question, file):
    told, names = written(sightline, dem(ELLIPSOID), question, tmp_path / "out")
    assert file not in names
    assert any(f"{file} is not written" in warning for warning in told["warnings"])
    told, names = written(sightline, dem(GEOID), question, tmp_path / "out")
    assert file in names
    assert not any(file in warning for warning in told["warnings"])


def test_a_track_leaves_its_elevations_out_and_a_rover_stays_on_the_ground(sightline, dem, tmp_path):
    told, names = written(sightline, dem(ELLIPSOID), plan(), tmp_path / "out")
    assert {"path.gpx", "path.plan"} <= names
    track = gpxpy.parse((tmp_path / "out" / "path.gpx").read_text())
    assert {point.elevation for point in track.tracks[0].segments[0].points} == {None}
    assert {(item["frame"], item["Altitude"]) for item in items_of(tmp_path / "out", "path.plan")} == {(10, 0.0)}
    assert sum("ellipsoid" in warning for warning in told["warnings"]) == 2


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


MSL = f"D1,{at(100, 200, '300msl')}"
TYPED = {
    "visibility": ("--anchor", MSL),
    "dop": ("--anchor", MSL),
    "dop ceiling": ("--anchor", MSL.replace("msl", "agl"), "--ceiling", "400msl", "--volume"),
    "dop cut": ("--anchor", MSL.replace("msl", "agl"), "--cut", "400msl"),
    "morph": ("--anchor", MSL.replace("msl", "agl"), "--ceiling", "400msl"),
    "morph available": (
        *("--anchor", MSL.replace("msl", "agl"), "--ceiling", "400agl"),
        *("--frames", "0,1,1", "--available-at", "400msl"),
    ),
    "los from": ("--from", at(100, 200, "300msl"), "--to", at(200, 200, "9agl")),
    "los to": ("--to", at(100, 200, "300msl"), "--from", at(200, 200, "9agl")),
    "place height": ("--count", 1, "--spacing", 150, "--height", "400msl"),
    "place base": (*PLACE[1:], "--base", at(100, 200, "300msl"), "--link-range", 9000),
    "place anchor": (*PLACE[1:], "--anchor", MSL),
    "plan": (*plan()[1:], "--anchor", MSL),
    "fly start": ("--start", at(100, 400, "600msl"), "--goal", at(750, 70, "90agl")),
    "fly ceiling": (*FLY[1:], "--ceiling", "900msl"),
    "reposition": (*MOVE[1:], "--anchor", f"D9,{at(100, 210, '300msl')}"),
}


@pytest.mark.parametrize("command", TYPED)
def test_msl_is_refused_where_heights_count_from_an_ellipsoid(sightline, dem, command):
    ended = sightline(command.split()[0], dem(ELLIPSOID), *TYPED[command])
    assert ended.code == 2
    assert "count from the ellipsoid (ellipsoid of WGS 84), and no geoid model" in ended.stderr
    assert "612hae" in ended.stderr


def test_masts_and_paths_say_msl_too(sightline, dem, tmp_path):
    (tmp_path / "points.geojson").write_text(
        json.dumps({"type": "MultiPoint", "coordinates_are": "metres", "coordinates": [[WEST_M + 90, NORTH_M - 90]]})
    )
    line = {
        "type": "LineString",
        "coordinates_are": "metres",
        "coordinates": [[WEST_M, NORTH_M], [WEST_M, NORTH_M - 99]],
    }
    (tmp_path / "line.geojson").write_text(json.dumps(line))
    for words in (
        ("place", dem(ELLIPSOID), "--count", 1, "--mast", f"{tmp_path / 'points.geojson'},400msl"),
        ("bubble", dem(ELLIPSOID), "--path", tmp_path / "line.geojson", "--height", "400msl", "--anchor", MSL),
    ):
        ended = sightline(*words)
        assert (ended.code, "no geoid model" in ended.stderr) == (2, True), ended.stderr


def test_hae_is_the_word_for_heights_above_the_ellipsoid(sightline, dem):
    hae = MSL.replace("msl", "hae")
    found = sightline("visibility", dem(ELLIPSOID), "--anchor", hae, "--json")
    assert found.code == 0, found.stderr
    assert json.loads(found.stdout)["anchors"][0]["altitude_m"] == 300.0
    ended = sightline("visibility", dem(GEOID), "--anchor", hae)
    assert ended.code == 2
    assert "612msl" in ended.stderr


@pytest.mark.parametrize(
    ("datum", "crs", "sentence"),
    [
        (GEOID, "EPSG:32611", None),
        (None, "EPSG:32611", "does not say what its heights count from"),
        (None, MOON, "Moon has no sea level"),
        (None, None, None),
    ],
)
def test_what_msl_was_taken_for_is_told_where_it_is_not_sure(sightline, dem, datum, crs, sentence):
    anchor = f"D1,{at(100, 200, '300msl', 1.2e6 if crs == MOON else NORTH_M)}"
    found = sightline("visibility", dem(datum, crs), "--anchor", anchor, "--json")
    told = [warning for warning in json.loads(found.stdout)["warnings"] if "msl" in warning]
    assert len(told) == (sentence is not None)
    assert all(sentence in warning for warning in told)


@pytest.mark.parametrize("datum", [None, "made up"])
def test_what_heights_count_from_is_said_once(sightline, dem, datum):
    start, goal = (f"{at(*place)},{height}" for place, height in (((100, 400), "150msl"), ((750, 70), "150msl")))
    words = ("--start", start, "--goal", goal, "--iterations", 2000)
    told = json.loads(sightline("fly", dem(datum), *words, "--json").stdout)
    assert told["status"] == "found"
    (warning,) = [one for one in told["warnings"] if "what its heights count from" in one]
    assert "flight.plan takes them as above mean sea level, and those given as msl were taken as it counts." in warning


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
