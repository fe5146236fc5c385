"""An area is a field of every request: inside it answers are those of the whole DEM, and ground outside still hides."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import shapely
from pydantic import ValidationError

from service.errors import RequestError
from service.parts.altitude_datums import in_dem_datum
from service.probes.places import probe
from service.probes.profiles import profiles
from service.probes.request import ProbeIn, ProfilesIn
from service.products import Finished, Product
from service.products.registry import PRODUCTS
from service.settings import Settings
from terrain import AreaError, ElevationGrid
from tests.planning.watching.grounds import ridge
from tests.service.detectors.test_sessions_over_a_map import epoch, opened
from tests.service.small_drives import drive_request
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from tests.service.small_paths import at

# east of the wall, which hides the anchor in the west from here; its sides run over posts
WINDOW = (2, 22, 19, 28)
BOX = {"west_m": WEST_M + 570.0, "south_m": NORTH_M - 440.0, "east_m": WEST_M + 840.0, "north_m": NORTH_M - 40.0}
ANCHORS = [
    {"id": "behind the wall", **at(95.0, 305.0), "altitude_m": 35.0},
    {"id": "b", **at(750.0, 200.0), "altitude_m": 160.0},
    {"id": "c", **at(300.0, 20.0), "altitude_m": 190.0},
    {"id": "d", **at(600.0, 440.0), "altitude_m": 140.0},
    {"id": "e", **at(860.0, 440.0), "altitude_m": 120.0},
]
AIR = {"anchors": ANCHORS, "ceiling_altitude_m": 400.0, "dop_limit": 30.0}
FLOOR = {**AIR, "anchors": ANCHORS[:4], "min_anchors": 4}
TRACK = {"id": "T", "points": [{"time_s": t, **at(60.0 + t, 60.0), "altitude_m": 70.0} for t in (0.0, 400.0)]}
FROM, TO = {**at(620.0, 400.0), "altitude_m": 300.0}, {**at(800.0, 90.0), "altitude_m": 320.0}
LINES = [{"from": {**at(95.0, 305.0), "altitude_m": 35.0}, "to": {**at(580.0, south), "above_ground_m": 2.0}}
         for south in (100.0, 200.0, 300.0)]  # fmt: skip
WAY = [{**at(600.0 + 20.0 * n, 300.0), "above_ground_m": 30.0} for n in range(9)]

# product: (what is asked, what the same is on the whole DEM without an area)
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "visibility-map": ({"anchors": ANCHORS}, {}),
    "window-map": ({"anchors": [{**anchor, "max_range_m": 2000.0} for anchor in ANCHORS]}, {}),
    "dop-map": ({"anchors": ANCHORS, "dop_limit": 30.0, "path": WAY}, {}),
    "morphing-map": ({**AIR, "tracks": [TRACK], "frames": {"to_s": 60.0, "step_s": 30.0, "above_ground_m": 50.0}}, {}),
    "path": (
        {"start": at(600.0, 400.0), "goals": [at(790.0, 80.0)], "anchors": ANCHORS, "limits": {"min_anchors": 3},
         "budget": {"sampling": False}},
        {"keep_in": [BOX]},
    ),
    "flight": ({"start": FROM, "goal": TO, "morphing_map": FLOOR, "bubble_m": 15.0, "budget": {"iterations": 500}}, {}),
    "placement": (
        {"count": 2, "candidates": [{"spacing_m": 90.0, "altitude_m": [90.0]}], "goal": {"min_anchors": 2},
         "anchors": ANCHORS[:1]},
        {"targets": {"area": BOX}, "candidates": [{"spacing_m": 90.0, "altitude_m": [90.0], "area": BOX}]},
    ),
    "repositioning": (
        {"anchors": ANCHORS[:2], "rover": {"place": at(590.0, 380.0), "heading_deg": 20.0, "ahead_m": 120.0},
         "goal": {"min_anchors": 2}, "flight": {"max_flight_m": 900.0}, "heights_above_ground_m": [60.0]},
        {},
    ),
    "site-map": ({"sites": 3, "directions": 64, "min_separation_m": 60.0}, {}),
    "lines-of-sight": ({"pairs": LINES}, {}),
    "safety-bubbles": ({"anchors": ANCHORS[:4], "points": WAY, "speed_m_per_s": 2.0}, {}),
    "protection-levels": ({"anchors": ANCHORS[:4], "height_sigma_m": 1.0, "path": WAY}, {}),
    "navigation": (drive_request(), {}),
}  # fmt: skip
# what is asked about a place outside the box, by product, and how the refusal calls it
STRAY = at(200.0, 300.0)
OUTSIDE: dict[str, tuple[dict[str, Any], str]] = {
    "dop-map": ({"path": [*WAY, {**STRAY, "above_ground_m": 9.0}]}, r"path\[9\]"),
    "path": ({"start": STRAY}, "The start"),
    "flight": ({"goal": {**STRAY, "altitude_m": 300.0}}, "The goal"),
    "placement": ({"targets": {"path": [at(600.0, 300.0), STRAY]}}, r"targets.path\[1\]"),
    "repositioning": ({"rover": {"place": STRAY, "heading_deg": 0.0}}, "Place 0 of the path ahead"),
    "lines-of-sight": ({"pairs": [*LINES, {"from": LINES[0]["from"], "to": {**STRAY, "altitude_m": 99.0}}]}, "line 3"),
    "protection-levels": ({"path": [*WAY, {**STRAY, "above_ground_m": 9.0}]}, r"path\[9\]"),
    "safety-bubbles": ({"points": [{**STRAY, "above_ground_m": 30.0}, *WAY]}, "Point 0"),
}


def calculated(product: Product, grid: ElevationGrid, asked: dict[str, Any], folder: Path) -> Finished:
    """As a worker does it, its check before."""
    parameters, _ = in_dem_datum(grid, product.parameters.model_validate(asked))
    product.refuse(grid, parameters, Settings())
    inputs = folder / f"inputs-{len(list(folder.iterdir()))}"
    return product.calculate(grid, product.unpacked(product.pack(grid, parameters, inputs), inputs))


def told(product: Product, finished: Any) -> dict[str, np.ndarray]:
    """What an answer holds, by name."""
    if product.name == "lines-of-sight":
        return {name: getattr(finished.sight, name) for name in ("verdict", "clearance_m", "blocking_point_m")}
    if product.name == "navigation":
        return {**finished.numbers(), "sight": finished.drive.sight}
    if product.name == "window-map":
        return {layer.name: rasterio.open(finished.folder / layer.name).read() for layer in product.layers}
    if product.name == "safety-bubbles":
        return {**finished.numbers(), "visible": finished.bubbles.visible}
    # from where a place is seen counts the ground where sites may stand, which is the area
    names = [name for name in product.arrays if name not in ("seen_from", "from_undecided")]
    return {name: getattr(finished, name) for name in names if getattr(finished, name) is not None}


def boxed(array: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The box of an array over posts or squares of a grid of that shape; anything else as it is."""
    top, bottom, left, right = WINDOW
    if array.shape[-2:] == shape:
        return array[..., top : bottom + 1, left : right + 1]
    if array.shape == (shape[0] - 1, shape[1] - 1):
        return array[top:bottom, left:right]
    return array


@pytest.mark.parametrize("name", list(PRODUCTS))
def test_inside_an_area_answers_are_those_of_the_whole_dem(name: str, tmp_path: Path) -> None:
    product, grid = PRODUCTS[name], small_grid()
    asked, on_the_whole = CASES[name]
    part = calculated(product, grid, {**asked, "area": BOX}, tmp_path)
    whole = calculated(product, grid, {**asked, **on_the_whole}, tmp_path)
    of_part, of_whole = told(product, part), told(product, whole)
    assert of_part.keys() == of_whole.keys()
    assert any(array.size for array in of_part.values())
    for array in of_part:
        np.testing.assert_array_equal(of_part[array], boxed(of_whole[array], grid.shape), err_msg=array)
    if name not in ("lines-of-sight", "window-map"):  # which have no ground of their own
        assert part.grid.shape == (21, 10)
        assert "The answer is for an area of" in " ".join(part.answer.warnings)


@pytest.mark.parametrize("name", list(PRODUCTS))
def test_ground_outside_an_area_still_hides(name: str, tmp_path: Path) -> None:
    """On a DEM that ends where the area does, the wall beside it hides nobody, so answers differ."""
    product, grid = PRODUCTS[name], small_grid()
    asked, _ = CASES[name]
    part = calculated(product, grid, {**asked, "area": BOX}, tmp_path)
    alone = calculated(product, grid.window(*WINDOW), asked, tmp_path)
    of_part, of_alone = told(product, part), told(product, alone)
    assert any(not np.array_equal(of_part[array], of_alone[array], equal_nan=True) for array in of_part)


@pytest.mark.parametrize("name", list(OUTSIDE))
def test_what_is_asked_about_a_place_outside_the_area_is_refused(name: str, tmp_path: Path) -> None:
    product, (changes, called) = PRODUCTS[name], OUTSIDE[name]
    with pytest.raises(AreaError, match=rf"{called}.* the area of the request"):
        calculated(product, small_grid(), {**CASES[name][0], **changes, "area": BOX}, tmp_path)


def test_every_request_that_names_a_dem_has_an_area() -> None:
    assert set(CASES) == set(PRODUCTS)
    for model in (*(product.asked for product in PRODUCTS.values()), ProbeIn, ProfilesIn):
        assert "area" in model.model_fields, model.__name__


def test_a_flight_stays_over_its_area_though_the_way_around_is_shorter(tmp_path: Path) -> None:
    """An area round a spike of ground: the straight line would leave it."""
    grid, product = small_grid(), PRODUCTS["flight"]
    corner = [at(580.0, 40.0), at(840.0, 40.0), at(840.0, 440.0), at(580.0, 440.0), at(580.0, 330.0),
              at(700.0, 330.0), at(700.0, 180.0), at(580.0, 180.0)]  # fmt: skip
    ends = {"start": {**at(620.0, 400.0), "altitude_m": 90.0}, "goal": {**at(620.0, 100.0), "altitude_m": 90.0}}
    asked = {**ends, "bubble_m": 10.0, "budget": {"iterations": 500}}
    free = calculated(product, grid, asked, tmp_path)
    kept = calculated(product, grid, {**asked, "area": {"ring": corner}}, tmp_path)
    shape = shapely.Polygon([(place["east_m"], place["north_m"]) for place in corner])
    assert not shape.covers(shapely.LineString(free.corners_m[:, :2]))
    assert shape.buffer(1e-6).covers(shapely.LineString(kept.corners_m[:, :2]))
    assert kept.answer.totals.length_m > free.answer.totals.length_m
    assert "way outside the keep-in areas" in {check.limit for check in kept.answer.validation.checks}


def test_the_area_of_a_plan_stands_beside_its_morphing_map() -> None:
    for name in ("flight", "path"):
        asked = {**CASES[name][0], "morphing_map": {**AIR, "area": BOX}}
        asked.pop("anchors", None)
        asked.pop("limits", None)
        with pytest.raises(ValidationError, match="stands beside its morphing_map"):
            PRODUCTS[name].parameters.model_validate(asked)


def test_probes_of_an_area_answer_as_without_it_and_refuse_what_is_outside() -> None:
    asked = {"dem_id": "d", "anchors": ANCHORS, "points": [at(600.0, 300.0), at(800.0, 100.0)]}
    whole, part = (probe(small_grid(), ProbeIn.model_validate({**asked, **more})) for more in ({}, {"area": BOX}))
    assert part == whole
    assert part.points[0].anchors[0].verdict == "hidden"
    with pytest.raises(AreaError, match=r"points\[1\] .* lies outside the area"):
        probe(small_grid(), ProbeIn.model_validate({**asked, "points": [at(600.0, 300.0), STRAY], "area": BOX}))
    lines = {"dem_id": "d", "pairs": LINES}
    whole, part = (profiles(small_grid(), ProfilesIn.model_validate({**lines, **more})) for more in ({}, {"area": BOX}))
    assert part == whole
    west = {"from": LINES[0]["from"], "to": {**STRAY, "altitude_m": 99.0}}
    with pytest.raises(AreaError, match="Neither end of line 0"):
        profiles(small_grid(), ProfilesIn.model_validate({"dem_id": "d", "pairs": [west], "area": BOX}))


def test_a_session_asks_the_dem_only_while_the_rover_is_in_the_area() -> None:
    """The rover drives north, a metre a second from 300 m; the area ends at 304 m."""
    area = {"west_m": 300.0, "south_m": 200.0, "east_m": 500.0, "north_m": 304.0}
    whole, part = (opened(ridge(ridge_m=45.0), dem_id="ridge", **more) for more in ({}, {"area": area}))
    for second in range(10):
        answers = [json.loads(session.answer(epoch(second, {"A1": 4.0, "A2": 4.0}))) for session in (whole, part)]
        if second <= 3:
            for answer in answers:  # how long it took is not the map's
                answer.pop("computation_ms", None)
            assert _untimed(answers[0]) == _untimed(answers[1])
            assert answers[1]["predicted"]
        if second >= 6:
            assert answers[0]["predicted"]
            assert not answers[1]["predicted"]
    asyncio.run(part.map_doubts())
    with pytest.raises(ValidationError, match="An area is one of a DEM"):
        opened(None, area=area)
    with pytest.raises((AreaError, RequestError)):
        opened(ridge(), dem_id="ridge", area={"ring": [{"east_m": 0.0, "north_m": 0.0}] * 3})


def _untimed(answer: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in answer.items() if "time" not in name and not name.endswith("_ms")}
