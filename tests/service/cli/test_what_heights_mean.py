"""Heights and places leave for other programs as what those take them for, or not at all; and so they come in."""

import json
import math
import zipfile
from dataclasses import replace

import gpxpy
import pyproj
import pytest

from terrain import ElevationGrid, egm96_height_m, height_at, to_grid_frame, to_lon_lat, write_npz
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


def geoid_m(point):
    """EGM96 below a place of an answer."""
    return float(egm96_height_m(*to_lon_lat(small_grid("EPSG:32611"), point["east_m"], point["north_m"])))


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
        "plans.zip and beacons.parm give altitudes above mean sea level: the DEM's, from the ellipsoid, less EGM96."
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


MSL = f"D1,{at(100, 200, '300msl')}"
THREE = tuple(
    word
    for name, east_m, south_m in (("A", 700, 60), ("B", 100, 200), ("C", 780, 300))
    for word in ("--anchor", f"{name},{at(east_m, south_m, '30agl')}")
)
TYPED = {
    "visibility": ("--anchor", MSL),
    "dop": (*THREE, "--anchor", MSL),
    "dop ceiling": (*THREE, "--ceiling", "600msl", "--volume"),
    "dop cut": (*THREE, "--cut", "500msl"),
    "morph": (*THREE, "--ceiling", "900msl"),
    "morph available": (*THREE, "--ceiling", "900agl", "--frames", "0,1,1", "--available-at", "600msl"),
    "los from": ("--from", at(100, 200, "300msl"), "--to", at(200, 200, "9agl")),
    "los to": ("--to", at(100, 200, "300msl"), "--from", at(200, 200, "9agl")),
    "place height": ("--count", 1, "--spacing", 150, "--height", "500msl", "--min-anchors", 1),
    "place base": (*PLACE[1:], "--base", at(100, 200, "300msl"), "--link-range", 9000),
    "place anchor": (*PLACE[1:], "--anchor", MSL),
    "plan": (*plan()[1:], "--anchor", MSL),
    "fly start": ("--start", at(100, 400, "600msl"), "--goal", at(750, 70, "90agl"), "--iterations", 2000),
    "fly ceiling": (*FLY[1:], "--ceiling", "900msl"),
    "reposition": (*MOVE[1:], "--anchor", f"D9,{at(100, 210, '300msl')}"),
}


@pytest.mark.parametrize("command", TYPED)
def test_msl_is_brought_to_the_ellipsoid_where_heights_count_from_it(sightline, dem, command):
    ended = sightline(command.split()[0], dem(ELLIPSOID), *TYPED[command], "--json")
    assert ended.code == 0, ended.stderr
    (told,) = (one for one in json.loads(ended.stdout)["warnings"] if "given as msl were brought" in one)
    assert told.startswith("Altitudes given as msl were brought to the DEM's datum, ellipsoid of WGS 84: -3")


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
        ("place", dem(ELLIPSOID), "--count", 1, "--mast", f"{tmp_path / 'points.geojson'},400msl", "--min-anchors", 1),
        ("bubble", dem(ELLIPSOID), "--path", tmp_path / "line.geojson", "--height", "400msl", "--anchor", MSL),
    ):
        ended = sightline(*words, "--json")
        assert ended.code == 0, ended.stderr
        assert any("given as msl were brought" in warning for warning in json.loads(ended.stdout)["warnings"])


def test_anchors_have_the_altitude_that_their_word_means(sightline, dem):
    def altitude_m(datum, word):
        found = sightline("visibility", dem(datum), "--anchor", MSL.replace("msl", word), "--json")
        assert found.code == 0, found.stderr
        return json.loads(found.stdout)["anchors"][0]

    hae = altitude_m(ELLIPSOID, "hae")
    assert hae["altitude_m"] == 300.0
    assert altitude_m(ELLIPSOID, "msl")["altitude_m"] == pytest.approx(300.0 + geoid_m(hae), abs=1e-6)
    assert altitude_m("EGM96 geoid", "msl")["altitude_m"] == 300.0
    assert altitude_m("EGM96 geoid", "hae")["altitude_m"] == pytest.approx(300.0 - geoid_m(hae), abs=1e-6)


def test_a_ceiling_is_right_in_the_middle_of_the_dem(sightline, dem):
    grid = small_grid("EPSG:32611")
    done = sightline("morph", dem(ELLIPSOID), *THREE, "--ceiling", "900msl", "--json")
    assert done.code == 0, done.stderr
    west_m, south_m, east_m, north_m = grid.bounds_m
    middle = {"east_m": (west_m + east_m) / 2.0, "north_m": (south_m + north_m) / 2.0}
    ceiling_m = json.loads(done.stdout)["ceiling"]["altitude_m"]
    assert ceiling_m == pytest.approx(900.0 + geoid_m(middle), abs=1e-6)


def test_files_of_anchors_say_what_altitudes_count_from(sightline, dem, tmp_path):
    told, _ = written(sightline, dem(ELLIPSOID), PLACE, tmp_path / "out")
    for name in ("anchors.geojson", "anchors.csv"):
        again = sightline("visibility", dem("EGM96 geoid"), "--anchors", tmp_path / "out" / name, "--json")
        assert again.code == 0, again.stderr
        for placed, read in zip(told["placed"], json.loads(again.stdout)["anchors"], strict=True):
            assert read["altitude_m"] == pytest.approx(placed["altitude_m"] - geoid_m(placed), abs=0.01)


def test_two_datums_in_one_list_of_heights_are_refused(sightline, dem):
    ended = sightline("place", dem(GEOID), "--count", 1, "--spacing", 150, "--height", "400msl", "--height", "400hae")
    assert (ended.code, "all as msl, or all as hae" in ended.stderr) == (2, True)


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
