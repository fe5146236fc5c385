"""sightline dop with satellites: an almanac or a navigation file as the source, and skies that are refused."""

import json

import pytest
from PIL import Image

from tests.service.cli.positioning_words import ANCHORS
from tests.service.skies import REFERENCE_DATE, TIME, almanac
from tests.visibility.satellites.constellation import shared_file


@pytest.fixture
def almanac_file(tmp_path):
    def write(text):
        path = tmp_path / "sky.al3"
        path.write_text(text)
        return path

    return write


def test_satellites_of_an_almanac_serve_as_anchors(sightline, dem_file, tmp_path, almanac_file):
    sky = almanac_file(almanac(unhealthy=2))
    ended = sightline(
        *("dop", dem_file, "--almanac", sky, "--time", TIME, "--reference-date", REFERENCE_DATE),
        *("--kind", "pseudorange", "--measure", "gdop", "--json", "--out", tmp_path / "out"),
    )  # fmt: skip
    told = ended.told()
    assert told["anchors"] == []
    assert len(told["satellites"]) >= 4
    assert all(5.0 - 0.3 < satellite["elevation_deg"] <= 90.0 for satellite in told["satellites"])
    assert "Satellites left out as unhealthy: G01, G02." in told["warnings"]
    with Image.open(tmp_path / "out" / "map.png") as picture:
        assert min(picture.size) > 400


def test_satellites_of_other_systems_in_an_almanac_are_passed_over_and_told(sightline, dem_file, almanac_file):
    text = almanac()
    sky = almanac_file(text.replace("\n\n24\n", "\n\n193\n"))
    assert "\n193\n" in sky.read_text()
    words = ("dop", dem_file, "--almanac", sky, "--time", TIME, "--reference-date", REFERENCE_DATE, "--json")
    ended = sightline(*words, "--kind", "pseudorange")
    assert ended.code == 0, ended.stderr
    assert "1 records of QZSS were passed over; only GPS is read." in json.loads(ended.stdout)["warnings"]


def test_a_narrower_cone_takes_fewer_satellites(sightline, dem_file, almanac_file):
    words = ("dop", dem_file, "--almanac", almanac_file(almanac()), "--time", TIME, "--json", *ANCHORS)
    wide, narrow = (json.loads(sightline(*words, "--cone-deg", cone).stdout)["satellites"] for cone in (85, 40))
    assert {s["id"] for s in narrow} == {s["id"] for s in wide if s["elevation_deg"] > 50.0}


BAD_SKIES = {
    "another week": (almanac(), ["--time", "2026-11-22T00:00:00Z", "--reference-date", REFERENCE_DATE], "days before"),
    "truncated": (almanac()[:1500], ["--time", TIME], "almanac"),
    "a missing field": (almanac().replace("  1.0000000000000E-04", "", 1), ["--time", TIME], "almanac"),
    "all unhealthy": (almanac(6, unhealthy=6), ["--time", TIME], "All 6 satellites of the almanac"),
    "empty": ("\n", ["--time", TIME], "is empty"),
    "no almanac": ("not orbits\n", ["--time", TIME], "neither a SEM nor a YUMA almanac"),
    "no time": (almanac(), [], "--almanac needs --time"),
    "a time without offset": (almanac(), ["--time", "2007-01-27T06:00:00"], "--time: a time needs its zone"),
    "no time at all": (almanac(), ["--time", "noon"], "'noon' is no ISO 8601 time"),
    "a cone beyond the horizon": (almanac(), ["--time", TIME, "--cone-deg", "120"], "--cone-deg: "),
    "half a place": (almanac(), ["--time", TIME, "--sky-at", "7"], "is not of the form LON,LAT"),
    "a place too many": (almanac(), ["--time", TIME, "--sky-at", "7,46"], "leave out the other place"),
}


@pytest.mark.parametrize("what", BAD_SKIES)
def test_a_sky_is_refused_in_one_sentence(sightline, dem_file, almanac_file, what):
    text, words, sentence = BAD_SKIES[what]
    ended = sightline("dop", dem_file, "--almanac", almanac_file(text), *words, "--json")
    ended.refused(sentence)


def test_a_navigation_file_serves_as_the_precise_source(sightline, dem_file):
    orbits = shared_file("rtklib_brdc0910.09n")
    words = ("dop", dem_file, "--kind", "pseudorange", "--measure", "tdop", "--json")
    ended = sightline(*words, "--navigation", orbits, "--time", "2009-04-01T12:00:00Z")
    assert ended.code == 0, ended.stderr
    assert len(json.loads(ended.stdout)["satellites"]) >= 4
    late = sightline(*words, "--navigation", orbits, "--time", "2009-05-01T12:00:00Z")
    assert (late.code, late.stderr.count("\n")) == (2, 1)
