"""``doubts`` of a request: what a session said against the map, taken back by maps, paths, bubbles and sessions."""

from __future__ import annotations

import asyncio
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from pydantic import ValidationError

from service.errors import RequestError
from service.live.registry import Detectors
from service.live.request import DetectorIn, EpochIn
from service.parts.doubts import MOST_PLACES, DoubtsIn, doubts_by_anchor
from service.probes.places import probe
from service.probes.previews import write_preview
from service.probes.request import PreviewIn, ProbeIn
from service.products import Given, Work
from service.products.registry import PRODUCTS
from service.settings import Settings
from terrain import ElevationGrid, height_at, to_lon_lat
from tests.service.small_maps import NORTH_M, WEST_M, small_grid, small_map
from tests.service.small_paths import ANCHORS, at, path_request
from visibility import UNKNOWN, VISIBLE

# across the straight way of the path, which ranges to W all along
LINE = (at(0.0, 300.0), at(420.0, 300.0))


def doubts(line: tuple[dict[str, float], ...] = LINE, **changes: Any) -> dict[str, Any]:
    """One doubt about the anchor W, as a session tells it."""
    grid, anchor = small_grid(), ANCHORS[0]
    middle = line[len(line) // 2]
    east_m, north_m = (float(anchor[name]) - middle[name] for name in ("east_m", "north_m"))
    told = {
        "anchor_id": "W",
        "expected": "in sight",
        "probability": 0.99,
        "bearing_deg": math.degrees(math.atan2(east_m, north_m)) % 360.0,
        "distance_m": math.hypot(east_m, north_m),
        **changes,
    }
    places = [list(to_lon_lat(grid, place["east_m"], place["north_m"])) for place in line]
    geometry = {"type": "LineString", "coordinates": places}
    features = [{"type": "Feature", "geometry": geometry, "properties": told}]
    return {"geojson": {"type": "FeatureCollection", "features": features}, "reach_m": 15.0}


def calculated(name: str, **asked: Any) -> Any:
    product = next(one for one in PRODUCTS.values() if one.name == name)
    parameters = product.completed(product.asked.model_validate({"dem_id": "d", **asked}), Given())
    return product.calculate(small_grid(), parameters, Work())


def test_a_map_has_the_anchor_unknown_along_the_line_and_tells_it() -> None:
    asked = {"anchors": ANCHORS}
    plain, found = calculated("visibility-map", **asked), calculated("visibility-map", **asked, doubts=doubts())
    grid = small_grid()
    east_m = grid.origin_east_m + grid.cell_east_m * np.arange(grid.cols)
    north_m = grid.origin_north_m - grid.cell_north_m * np.arange(grid.rows)
    posts = shapely.points(np.stack(np.meshgrid(east_m, north_m), axis=-1))
    line = shapely.LineString([(place["east_m"], place["north_m"]) for place in LINE])
    near = shapely.distance(line, posts) < 15.0 * math.sqrt(2.0 * math.log(2.0 * 0.99))
    seen = plain.visible[0] == VISIBLE
    assert (near & seen).sum() > 10
    assert (found.visible[0][near & seen] == UNKNOWN).all()
    assert np.array_equal(found.visible[0][~near], plain.visible[0][~near])
    assert np.array_equal(found.visible[1:], plain.visible[1:])
    assert any("Ranges of anchor W contradicted its sight along 1 stretch" in one for one in found.answer.warnings)
    assert found.answer.anchors[0].unknown_share > plain.answer.anchors[0].unknown_share


@pytest.mark.parametrize("name", ["dop-map", "morphing-map"])
def test_maps_of_positioning_do_not_count_on_it(name: str) -> None:
    asked: dict[str, Any] = {"anchors": ANCHORS, "dop_limit": 6.0}
    if name == "morphing-map":
        asked["ceiling_above_ground_m"] = 200.0
    plain, found = calculated(name, **asked), calculated(name, **asked, doubts=doubts())
    array = "dop" if name == "dop-map" else "safe_above_m"
    before, after = getattr(plain, array), getattr(found, array)
    changed = ~((before == after) | (np.isnan(before) & np.isnan(after)))
    rows, _ = np.nonzero(changed)
    assert len(rows) > 5
    assert set(rows.tolist()) <= {14, 15, 16}
    assert not (after < before).any()
    assert any("contradicted its sight" in one for one in found.answer.warnings)


def test_a_plan_and_its_map_take_the_doubts_along() -> None:
    # in the west only W and S are in sight of either side; further east N as well
    asked = path_request((at(45.0, 430.0), at(100.0, 200.0)), limits={"min_anchors": 2}, no_go=[])
    plain, found = calculated("path", **asked), calculated("path", **asked, doubts=doubts())
    assert plain.answer.status == "found"
    assert found.answer.status == "found"
    assert found.answer.totals.length_m > plain.answer.totals.length_m + 100.0
    assert any("contradicted its sight" in one for one in found.answer.warnings)
    product = next(one for one in PRODUCTS.values() if one.name == "path")
    mapped = calculated("visibility-map", anchors=ANCHORS, doubts=doubts()).answer.model_dump(mode="json")
    on = {name: value for name, value in asked.items() if name != "anchors"}
    given = Given("visibility-map", mapped["parameters"])
    parameters: Any = product.completed(product.asked.model_validate({"dem_id": "d", "map_id": "m", **on}), given)
    assert parameters.doubts.reach_m == 15.0


def test_bubbles_do_not_count_on_it() -> None:
    points = [{**at(100.0, south_m), "above_ground_m": 2.0} for south_m in (220.0, 300.0, 380.0)]
    asked = {"anchors": ANCHORS, "points": points}
    plain, found = calculated("safety-bubbles", **asked), calculated("safety-bubbles", **asked, doubts=doubts())
    assert plain.bubbles.visible[:, 0].tolist() == [True, True, True]
    assert found.bubbles.visible[:, 0].tolist() == [True, False, True]
    assert found.bubbles.radius_m[1] > plain.bubbles.radius_m[1]


@pytest.mark.parametrize("name", ["placement", "repositioning"])
def test_drones_are_not_counted_on_where_it_is_denied(name: str) -> None:
    # W and S alone are in sight all along
    way = [at(45.0, 430.0), at(45.0, 200.0)]
    asked: dict[str, Any] = {"anchors": ANCHORS, "goal": {"objective": "coverage", "min_anchors": 2}}
    if name == "placement":
        more = {"count": 1, "candidates": [{"places": [at(420.0, 250.0)], "above_ground_m": [60.0]}]}
        asked |= {**more, "targets": {"path": way}}
    else:
        asked |= {"path": way, "movable": ["N"], "flight": {"max_flight_m": 30.0}}
    plain, found = calculated(name, **asked), calculated(name, **asked, doubts=doubts())
    across = 2.0 * 15.0 * math.sqrt(2.0 * math.log(2.0 * 0.99)) / 230.0
    assert plain.answer.before_share == 1.0
    assert found.answer.before_share == pytest.approx(1.0 - across, abs=0.05)
    assert any("Ranges of anchor W contradicted its sight" in one for one in found.answer.warnings)
    elsewhere = calculated(name, **asked, doubts=doubts(anchor_id="Z"))
    assert "Doubts about Z are passed over: no such anchor is asked about." in elsewhere.answer.warnings


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"anchor_id": "Z"}, "Doubts about Z are passed over: no such anchor is asked about."),
        ({"distance_m": 900.0}, "Doubts about W are passed over: the anchor stands elsewhere now."),
        ({"expected": "hidden"}, "Ranges heard W where the map hides it; a map does not count on that."),
    ],
)
def test_what_changes_nothing_is_told(changes: dict[str, Any], sentence: str) -> None:
    plain = calculated("visibility-map", anchors=ANCHORS)
    found = calculated("visibility-map", anchors=ANCHORS, doubts=doubts(**changes))
    assert sentence in found.answer.warnings
    assert np.array_equal(found.visible, plain.visible)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"probability": 2.0}, "shape 0, is no doubt of a session: probability"),
        ({"expected": "odd"}, "shape 0, is no doubt of a session: expected"),
    ],
)
def test_what_is_no_doubt_is_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(RequestError, match=sentence):
        small_map(doubts=doubts(**changes))


def test_thousands_of_doubts_all_count_and_more_than_that_are_refused_unread() -> None:
    one = doubts()["geojson"]["features"][0]
    grid, anchor = small_grid(), {"W": (float(ANCHORS[0]["east_m"]), float(ANCHORS[0]["north_m"]))}
    half = MOST_PLACES // len(LINE)
    told = [{**one, "properties": {**one["properties"], "probability": n / half}} for n in range(half)]
    collection = {"type": "FeatureCollection", "features": told}
    found, passed_over = doubts_by_anchor(grid, DoubtsIn(geojson=collection, reach_m=15.0), anchor)
    assert [doubt.probability for doubt in found["W"]] == [n / half for n in range(half)]
    assert passed_over == ()
    collection["features"] = [*told, one, {"type": "Feature", "geometry": {"type": "Point", "coordinates": ["x"]}}]
    with pytest.raises(RequestError, match=r"doubts.geojson holds more than 10,000 places\."):
        doubts_by_anchor(grid, DoubtsIn(geojson=collection), anchor)


def test_a_probe_on_the_line_does_not_count_on_it() -> None:
    points = [LINE[0], LINE[1], at(210.0, 600.0)]
    asked = [ProbeIn.model_validate({"dem_id": "d", "points": points, "anchors": ANCHORS, **more})
             for more in ({}, {"doubts": doubts()})]  # fmt: skip
    plain, found = (probe(small_grid(), one) for one in asked)
    for number, (before, after) in enumerate(zip(plain.points, found.points, strict=True)):
        lost = number < 2 and before.anchors[0].verdict == "visible"
        assert lost == (number < 2)
        assert after.anchors[0].verdict == ("unknown" if lost else before.anchors[0].verdict)
        assert after.visible_anchors == before.visible_anchors - lost
        assert after.anchors[1:] == before.anchors[1:]
    assert any("Ranges of anchor W contradicted its sight along 1 stretch" in one for one in found.warnings)


def test_a_preview_has_it_for_unknown_along_the_line(tmp_path: Path) -> None:
    seen = []
    for more in ({}, {"doubts": doubts()}):
        write_preview(
            small_grid(), PreviewIn.model_validate({"dem_id": "d", "anchors": ANCHORS, **more}), tmp_path / "p"
        )
        head, _, numbers = (tmp_path / "p").read_bytes().partition(b"\n")
        told = json.loads(head)
        seen.append(np.frombuffer(numbers, "<f4").reshape(len(ANCHORS), told["rows"], told["cols"]))
    assert any("Ranges of anchor W contradicted its sight" in one for one in told["warnings"])
    grid = small_grid()
    row, col = (
        round((NORTH_M - LINE[0]["north_m"]) / grid.cell_north_m),
        round((LINE[0]["east_m"] - WEST_M) / grid.cell_east_m),
    )
    assert np.isnan([array[0, row, col] for array in seen]).tolist() == [False, True]
    assert np.array_equal(seen[0][1:], seen[1][1:], equal_nan=True)


def test_areas_and_unknown_fields_are_refused() -> None:
    ring = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    with pytest.raises(RequestError, match="a doubt is a line or a point"):
        small_map(doubts={"geojson": {"type": "FeatureCollection", "features": [feature]}})
    with pytest.raises(ValidationError, match="reach"):
        small_map(doubts={**doubts(), "reach_m": 0.0})
    assert small_map(doubts={"geojson": {"type": "FeatureCollection", "features": []}}).answer.warnings


def sessions(grid: ElevationGrid, **more: Any) -> tuple[Any, list[float]]:
    """(a session, its p_sight of W) over half a minute in which the ranges of W are 9 m too long."""
    anchors = [
        {**one, "altitude_m": float(height_at(grid, one["east_m"], one["north_m"])) + one["above_ground_m"]}
        for one in [*ANCHORS, {"id": "M", **at(250.0, 420.0), "above_ground_m": 70.0}]
    ]
    for one in anchors:
        del one["above_ground_m"]
    asked = {"anchors": anchors, "settings": {"harmful_m": 0.5}, "dem_id": "d", "dem_sigma_m": 1.0, **more}
    session, told = Detectors(Settings()).open(DetectorIn.model_validate(asked), grid), []
    for second in range(30):
        east_m, north_m = WEST_M + 150.0 + second, NORTH_M - 300.0
        rover_m = (east_m, north_m, float(height_at(grid, east_m, north_m)) + 1.5)
        ranges = [
            {
                "anchor_id": one["id"],
                "range_m": math.dist((one["east_m"], one["north_m"], one["altitude_m"]), rover_m)
                + 9.0 * (one["id"] == "W"),
            }
            for one in anchors
        ]
        answer = json.loads(session.answer(EpochIn.model_validate({"time_s": float(second), "ranges": ranges})))
        foretold = {one["anchor_id"]: one["p_sight"] for one in answer["predicted"] or []}
        told.append(foretold.get("W", math.nan))
    return session, told


def test_what_one_session_says_the_next_one_and_a_map_take_as_it_is() -> None:
    grid = small_grid()
    first, before = sessions(grid)
    said = json.loads(asyncio.run(first.map_doubts()))
    # E is behind the wall, and is heard straight through it
    expected = {one["properties"]["anchor_id"]: one["properties"]["expected"] for one in said["features"]}
    assert expected == {"W": "in sight", "E": "hidden"}
    assert min(before[5:]) > 0.9
    second, after = sessions(grid, doubts={"geojson": said})
    assert max(after[8:25]) < 0.1
    assert json.loads(asyncio.run(second.map_doubts()))["features"] == []
    map_ = calculated("visibility-map", anchors=ANCHORS, doubts={"geojson": said})
    assert "Ranges heard E where the map hides it; a map does not count on that." in map_.answer.warnings
    row, col = round(300.0 / 20.0), round(165.0 / 30.0)
    assert map_.visible[0][row, col] == UNKNOWN


def test_doubts_of_a_session_need_a_dem() -> None:
    with pytest.raises(ValidationError, match="Doubts are about a DEM"):
        DetectorIn.model_validate({"anchors": [], "doubts": doubts()})
