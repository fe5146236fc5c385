"""Questions over the small ground with heights that count from somewhere, for tests of what heights mean."""

import json
import zipfile

from terrain import egm96_height_m, to_lon_lat
from tests.service.small_maps import NORTH_M, WEST_M, small_grid

ELLIPSOID, GEOID = "ellipsoid of WGS 84", "EGM2008 height"
MOON = (
    'PROJCRS["Moon",BASEGEOGCRS["Moon",DATUM["Moon",ELLIPSOID["Moon",1737400,0]]],CONVERSION["Moon",'
    'METHOD["Transverse Mercator"],PARAMETER["Latitude of natural origin",0],'
    'PARAMETER["Longitude of natural origin",30],PARAMETER["Scale factor at natural origin",1],'
    'PARAMETER["False easting",400000],PARAMETER["False northing",0]],CS[Cartesian,2],AXIS["(E)",east],'
    'AXIS["(N)",north],LENGTHUNIT["metre",1]]'
)


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
