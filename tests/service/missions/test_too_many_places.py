"""A file of more places than a mission may have is refused while it is read: what comes after them is not looked at."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from service.cli.asking.anchor_files import MOST_ANCHORS, anchors_from_file
from service.errors import RequestError
from service.files.foreign.reading import read_foreign
from service.missions.importing import MOST_PLACES, import_places
from tests.service.small_maps import small_grid

MANY = MOST_PLACES + 1
# what each reader would complain about, if it came to it
BROKEN = "no number"


def kml(number: int) -> bytes:
    mark = "<Placemark><name>P</name><Point><coordinates>11.5,46.5</coordinates></Point></Placemark>"
    return f"<kml><Document>{mark * number}{mark.replace('46.5', BROKEN)}</Document></kml>".encode()


def kml_line(number: int) -> bytes:
    places = " ".join(["11.5,46.5"] * number)
    line = f"<Placemark><LineString><coordinates>{places} 11.5,{BROKEN}</coordinates></LineString></Placemark>"
    return f"<kml><Document>{line}</Document></kml>".encode()


def kmz(number: int) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", kml(number))
    return packed.getvalue()


def gpx(number: int) -> bytes:
    points = '<trkpt lat="46.5" lon="11.5"/>' * number + f'<trkpt lat="{BROKEN}" lon="11.5"/>'
    head = '<gpx version="1.1" creator="x" xmlns="http://www.topografix.com/GPX/1/1">'
    return f"{head}<trk><trkseg>{points}</trkseg></trk></gpx>".encode()


def plan(number: int) -> bytes:
    points = [[46.5, 11.5, 0.0]] * number + [[46.5]]
    return json.dumps({"fileType": "Plan", "rallyPoints": {"points": points}}).encode()


def geojson(number: int) -> bytes:
    features = [{"type": "Feature", "geometry": {"type": "Point", "coordinates": [11.5, 46.5]}, "properties": {}}]
    broken = {"type": "Point", "coordinates": [11.5, BROKEN]}
    return json.dumps({"type": "FeatureCollection", "features": [*features * number, broken]}).encode()


def geojson_line(number: int) -> bytes:
    return json.dumps({"type": "LineString", "coordinates": [[11.5, 46.5]] * number + [[11.5, BROKEN]]}).encode()


def csv(number: int) -> bytes:
    return ("id,lon_deg,lat_deg\n" + "A,11.5,46.5\n" * number + f"A,11.5,{BROKEN}\n").encode()


def anchors(number: int) -> bytes:
    one = {"id": "A", "lon_deg": 11.5, "lat_deg": 46.5}
    return json.dumps([*[one] * number, {**one, "lat_deg": BROKEN}]).encode()


FILES: dict[str, tuple[str, Callable[[int], bytes]]] = {
    "KML": ("a.kml", kml),
    "a line in KML": ("a.kml", kml_line),
    "KMZ": ("a.kmz", kmz),
    "GPX": ("a.gpx", gpx),
    "a plan": ("a.plan", plan),
    "GeoJSON": ("a.geojson", geojson),
    "a line in GeoJSON": ("a.geojson", geojson_line),
    "CSV": ("a.csv", csv),
    "anchors": ("a.json", anchors),
}


@pytest.mark.parametrize("what", FILES)
def test_what_is_behind_too_many_places_is_not_read(what: str, tmp_path: Path) -> None:
    name, written = FILES[what]
    path = tmp_path / name
    path.write_bytes(written(MANY))
    with pytest.raises(RequestError, match="holds more than 10,000 places"):
        import_places(path, small_grid())
    # of few places the same file is refused for what is broken in it
    path.write_bytes(written(3))
    with pytest.raises(RequestError) as refused:
        import_places(path, small_grid())
    assert "more than" not in str(refused.value)


def test_commands_read_longer_tracks_than_missions_have() -> None:
    number = 2 * MOST_PLACES
    track = gpx(number).replace(f'<trkpt lat="{BROKEN}" lon="11.5"/>'.encode(), b"")
    (feature,) = read_foreign("a.gpx", track).features
    geometry = feature["geometry"]
    assert isinstance(geometry, dict)
    assert len(geometry["coordinates"]) == number


def test_a_table_of_more_anchors_than_anybody_has_is_not_read_on(tmp_path: Path) -> None:
    path = tmp_path / "anchors.csv"
    path.write_text("id,east_m,north_m,above_ground_m\n" + "A,1,2,3\n" * (MOST_ANCHORS + 1) + f"A,1,2,{BROKEN}\n")
    with pytest.raises(RequestError, match="holds more than 10,000 anchors"):
        anchors_from_file(path)
