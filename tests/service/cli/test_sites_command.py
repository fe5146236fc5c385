"""sightline sites: a table that the next command takes as anchors, and wrong lines told in a sentence."""

import json

from tests.service.small_maps import NORTH_M, WEST_M


def test_named_sites_are_the_next_commands_anchors(sightline, dem_file, tmp_path):
    out = tmp_path / "out"
    words = ("--height", 30, "--count", 3, "--separation", 150, "--directions", 32, "--out", out)
    told = sightline("sites", dem_file, *words, "--json").told()
    names = {path.name for path in out.iterdir()}
    rasters, pictures = {"seen.tif", "seen_from.tif"}, {"map.png"}
    assert names == {"sites.json", "sites.csv", "sites.geojson"} | rasters | pictures
    seen = sightline("visibility", dem_file, "--anchors", out / "sites.csv", "--json").told()
    assert [anchor["id"] for anchor in seen["anchors"]] == [site["id"] for site in told["sites"]] == ["S1", "S2", "S3"]
    assert [anchor["above_ground_m"] for anchor in seen["anchors"]] == [30.0] * 3
    words = (
        "--count",
        1,
        "--site",
        f"{out / 'sites.geojson'},30agl",
        "--objective",
        "coverage",
        "--min-anchors",
        1,
        "--json",
    )
    placed = sightline("place", dem_file, *words)
    assert placed.code == 0, placed.stderr


def test_it_says_how_far_to_trust_it(sightline, dem_file):
    done = sightline("sites", dem_file, "--directions", 16, "--count", 1)
    assert done.code == 0, done.stderr
    assert "Rays in 16 directions, which see the ground only where they cross columns" in done.stdout + done.stderr


def test_wrong_lines_are_told(sightline, dem_file, tmp_path):
    for words, sentence in (
        (("--directions", 30), "directions"),
        (("--height", -1), "--height: "),
        (("--max-range", 0), "--max-range: "),
        (("--area", f"{WEST_M + 9e5},{NORTH_M},{WEST_M + 9.1e5},{NORTH_M + 1e4}"), "area"),
    ):
        ended = sightline("sites", dem_file, *words)
        assert (ended.code, ended.stdout) == (2, "")
        assert sentence in ended.stderr
        assert ended.stderr.count("\n") == 1
    ring = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]
    many = {"type": "MultiPolygon", "coordinates": [[ring], [ring]]}
    (tmp_path / "many.geojson").write_text(json.dumps(many))
    ended = sightline("sites", dem_file, "--targets", tmp_path / "many.geojson")
    assert (ended.code, "many.geojson holds 2 polygons; --targets is one." in ended.stderr) == (2, True)
