"""Cover that cannot be used as it is: refused, resampled or told over HTTP, by one rule each."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from affine import Affine

from service.products.registry import PRODUCTS
from tests.service.asked import ASKED
from tests.service.http.test_bad_requests import assert_problem
from tests.service.http.test_every_product import posted
from tests.service.running import Server
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, COLS, NORTH_M, ROWS, WEST_M
from tests.service.test_cover_of_products import footprints
from tests.terrain.files import write_tif

MAP = PRODUCTS["visibility-map"]


def town(change: str) -> dict[str, Any]:
    """The town with something wrong in its first building."""
    found = footprints()
    first = found["features"][0]
    ring = first["geometry"]["coordinates"][0]
    if change == "bow tie":
        first["geometry"]["coordinates"][0] = [ring[0], ring[2], ring[1], ring[3], ring[0]]
    elif change == "no height":
        del first["properties"]["height"]
    elif change == "levels":
        first["properties"] = {"building": "yes", "building:levels": "20"}
    elif change == "outside":
        first["geometry"]["coordinates"][0] = [[east + 0.2, north] for east, north in ring]
    elif change == "all outside":
        for feature in found["features"]:
            here = feature["geometry"]["coordinates"][0]
            feature["geometry"]["coordinates"][0] = [[east + 0.2, north] for east, north in here]
    return found


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("bow tie", "is no simple polygon (Self-intersection"),
        ("no height", "have no height, the first is way/0"),
        ("levels", "have no height, the first is way/0"),
        ("all outside", "footprints has known ground under its middle"),
    ],
)
def test_footprints_that_cannot_stand_are_refused_with_the_first_of_them(
    server: Server, ground: dict[str, Any], change: str, sentence: str
) -> None:
    refused = posted(server, MAP, ground, cover={"footprints": {"geojson": town(change)}})
    assert_problem(refused, 422, "cover", sentence)


def test_levels_count_where_they_are_asked_for_and_what_lies_outside_is_left_out(
    server: Server, ground: dict[str, Any]
) -> None:
    levels = posted(server, MAP, ground, cover={"footprints": {"geojson": town("levels"), "level_m": 3.0}})
    assert levels.status_code == 201, levels.text
    assert any("taken as 3.0 m each, as asked: " in warning for warning in levels.json()["result"]["warnings"])
    outside = posted(server, MAP, ground, cover={"footprints": {"geojson": town("outside")}}).json()["result"]
    assert any("have no known ground under their middle and are left out" in one for one in outside["warnings"])
    assert outside["dem"]["cover"]["buildings"]["solids"] == len(footprints()["features"]) - 1


def crowns(tmp_path: Path, values: Any, crs: str, transform: Affine) -> dict[str, str]:
    path = write_tif(tmp_path / "crowns.tif", np.asarray(values, np.float32), crs=crs, transform=transform)
    return {"name": path.name, "base64": base64.b64encode(path.read_bytes()).decode()}


def test_a_canopy_of_other_posts_or_crs_is_brought_over_and_told(
    server: Server, ground: dict[str, Any], tmp_path: Path
) -> None:
    coarse = Affine(3 * CELL_EAST_M, 0.0, WEST_M - 45.0, 0.0, -3 * CELL_NORTH_M, NORTH_M + 30.0)
    told = []
    for crs, transform, shape in (
        ("EPSG:32611", coarse, (ROWS // 3 + 1, COLS // 3 + 1)),
        ("EPSG:4326", Affine(2e-4, 0.0, -118.1, 0.0, -2e-4, 34.36), (300, 300)),
    ):
        heights = crowns(tmp_path, np.full(shape, 11.0), crs, transform)
        answer = posted(server, MAP, ground, cover={"canopy": {"heights": heights}})
        assert answer.status_code == 201, answer.text
        result = answer.json()["result"]
        trees = result["dem"]["cover"]["canopy"]
        assert (trees["mean_top_m"], trees["model"]) == (pytest.approx(11.0), "weissberger")
        told.append(result["warnings"])
    assert any("posts are 90 by 60 m apart; it was resampled to the DEM's" in one for one in told[0])
    assert any(one.startswith("The canopy's raster: Warped from WGS 84") for one in told[1])


def test_a_negative_canopy_and_one_of_elsewhere_are_refused(
    server: Server, ground: dict[str, Any], tmp_path: Path
) -> None:
    here = Affine(CELL_EAST_M, 0.0, WEST_M - 15.0, 0.0, -CELL_NORTH_M, NORTH_M + 10.0)
    below = crowns(tmp_path, np.full((ROWS, COLS), -2.0), "EPSG:32611", here)
    refused = posted(server, MAP, ground, cover={"canopy": {"heights": below}})
    assert_problem(refused, 422, "cover", f"must be heights >= 0 m; {ROWS * COLS} posts are below")
    away = Affine(CELL_EAST_M, 0.0, WEST_M + 50_000.0, 0.0, -CELL_NORTH_M, NORTH_M)
    elsewhere = crowns(tmp_path, np.full((ROWS, COLS), 2.0), "EPSG:32611", away)
    refused = posted(server, MAP, ground, cover={"canopy": {"heights": elsewhere}})
    assert_problem(refused, 422, "cover", "The canopy lies nowhere on the ground")


def test_crown_bases_and_densities_come_as_rasters_too(server: Server, ground: dict[str, Any], tmp_path: Path) -> None:
    here = Affine(CELL_EAST_M, 0.0, WEST_M - 15.0, 0.0, -CELL_NORTH_M, NORTH_M + 10.0)
    coarse = Affine(3 * CELL_EAST_M, 0.0, WEST_M - 45.0, 0.0, -3 * CELL_NORTH_M, NORTH_M + 30.0)
    densities = crowns(tmp_path, np.full((ROWS, COLS), 0.05), "EPSG:32611", here)
    bases = crowns(tmp_path, np.full((ROWS // 3 + 1, COLS // 3 + 1), 3.0), "EPSG:32611", coarse)
    canopy = {"top_m": 12.0, "bases": bases, "densities": densities, "model": "density"}
    answer = posted(server, MAP, ground, cover={"canopy": canopy})
    assert answer.status_code == 201, answer.text
    result = answer.json()["result"]
    trees = result["dem"]["cover"]["canopy"]
    assert (trees["mean_base_m"], trees["mean_density_per_m"]) == (pytest.approx(3.0), pytest.approx(0.05))
    assert (trees["depth_per_m"], trees["by_direction"]) == (None, False)
    told = [one for one in result["warnings"] if "resampled" in one]
    assert told == ["The crown base's posts are 90 by 60 m apart; it was resampled to the DEM's."]
    west = np.arange(COLS)[None, :] < 2
    high = crowns(tmp_path, np.where(west, 30.0, 3.0) * np.ones((ROWS, 1)), "EPSG:32611", here)
    partly = crowns(tmp_path, np.where(west, np.nan, 0.05) * np.ones((ROWS, 1)), "EPSG:32611", here)
    answer = posted(server, MAP, ground, cover={"canopy": {**canopy, "bases": high, "densities": partly}})
    told = answer.json()["result"]["warnings"]
    number = f"At {2 * ROWS} of {ROWS * COLS} posts with trees"
    assert {
        f"{number} crowns would begin above their tops: no crowns there.",
        f"{number} their density is unknown.",
    } < {*told}
    both = posted(server, MAP, ground, cover={"canopy": {**canopy, "base_m": 2.0}})
    assert_problem(both, 422, "validation", "begin at base_m or at the heights of bases; give one")
    other = posted(server, MAP, ground, cover={"canopy": {**canopy, "model": "weissberger"}})
    assert_problem(other, 422, "validation", "densities belongs to the model density, and to no other")
    below = {**canopy, "densities": crowns(tmp_path, np.full((ROWS, COLS), -0.1), "EPSG:32611", here)}
    assert_problem(posted(server, MAP, ground, cover={"canopy": below}), 422, "cover", "must be numbers from 0 to")


@pytest.mark.parametrize("name", ["visibility-map", "safety-bubbles", "path", "placement"])
def test_a_frequency_that_the_canopy_s_model_does_not_know_is_told_and_not_extended(
    server: Server, ground: dict[str, Any], name: str
) -> None:
    low = {"frequency_hz": 120e6, "transmit_power_dbm": 30.0, "sensitivity_dbm": -120.0}
    heard: dict[str, Any] = {"sight": "usable", "cover": {"canopy": {"top_m": 200.0}}}
    if ASKED[name].get("anchors"):
        heard["anchors"] = [{**one, "radio": low} for one in ASKED[name]["anchors"]]
    if name == "placement":
        heard |= {"radio": low, "count": 2}
    if name == "path":
        heard["limits"] = {}
    answer = posted(server, PRODUCTS[name], ground, **heard)
    assert answer.status_code == 201, answer.text
    result = answer.json()["result"]
    told = [one for one in result["warnings"] if "nothing is told at 120 MHz" in one]
    assert told == ["Weissberger's model is for 230 to 95000 MHz; nothing is told at 120 MHz."]
    if name == "visibility-map":
        assert all(one["visible_share"] == 0.0 for one in result["anchors"])
        assert all(one["unknown_share"] > 0.9 for one in result["anchors"])


def test_a_frequency_that_no_model_knows_is_refused(server: Server, ground: dict[str, Any]) -> None:
    anchors = [{**one, "radio": {"preset": "uwb", "frequency_hz": 1e6}} for one in ASKED[MAP.name]["anchors"]]
    refused = posted(server, MAP, ground, anchors=anchors, sight="usable")
    assert_problem(refused, 422, "validation", "frequency_hz must lie between 3e+07 and 1e+11")
