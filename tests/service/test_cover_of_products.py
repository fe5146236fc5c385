"""Buildings of a request stand on the ground of every product, at every door."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from pydantic import ValidationError

from planning import PlaceError
from service.errors import RequestError
from service.live.request import DetectorIn
from service.live.watching import memory_of
from service.parts.cover import CoverIn, CoverParameters, covered
from service.probes.places import probe
from service.probes.profiles import profiles
from service.probes.request import ProbeIn, ProfilesIn
from service.products import Given, Work
from service.products.registry import PRODUCTS
from terrain import ElevationGrid, to_lon_lat
from tests.service.asked import ASKED
from tests.service.small_maps import small_grid
from tests.service.small_paths import at, path_request
from visibility import CoverError
from visibility.cover import parse_footprints

# what changes from run to run, or repeats the question
NO_FIGURES = {"parameters", "timing", "elapsed_s", "warnings", "version", "dem", "created_at"}
# over the straight way of the path, between anchors and rovers, and on the ways of the bubbles and the lines
BLOCKS = ((230.0, 210.0, 60.0), (470.0, 180.0, 40.0), (160.0, 295.0, 25.0), (705.0, 295.0, 45.0))


def ring(east_m: float, south_m: float, side_m: float = 40.0) -> list[list[float]]:
    corners = [(0, 0), (side_m, 0), (side_m, side_m), (0, side_m), (0, 0)]
    places = (at(east_m + right, south_m + down) for right, down in corners)
    return [list(to_lon_lat(small_grid(), place["east_m"], place["north_m"])) for place in places]


def footprints() -> dict[str, Any]:
    features = [
        {
            "type": "Feature",
            "id": f"way/{number}",
            "properties": {"building": "yes", "height": str(height_m)},
            "geometry": {"type": "Polygon", "coordinates": [ring(east_m, south_m)]},
        }
        for number, (east_m, south_m, height_m) in enumerate(BLOCKS)
    ]
    return {"type": "FeatureCollection", "features": features}


COVER = {"footprints": {"geojson": footprints()}}


def calculated(name: str, **changes: Any) -> dict[str, Any]:
    """The answer of one product, as the task of a worker has it."""
    product = PRODUCTS[name]
    parameters = product.parameters.model_validate({**ASKED[name], **changes})
    grid = covered(small_grid(), parameters)
    document: dict[str, Any] = product.calculate(grid, parameters, Work()).answer.model_dump(mode="json")
    return document


@pytest.mark.parametrize("name", sorted(ASKED.keys() - {"site-map", "window-map", "lines-of-sight"}))
def test_the_figures_of_every_product_know_the_buildings_of_its_request(name: str) -> None:
    bare, built = calculated(name), calculated(name, cover=COVER)

    def figures(answer: dict[str, Any]) -> str:
        return json.dumps({key: value for key, value in answer.items() if key not in NO_FIGURES}, sort_keys=True)

    assert figures(bare) == figures(calculated(name)), "so what differs below is the buildings'"
    assert figures(built) != figures(bare)


def test_more_is_hidden_and_nothing_more_is_seen() -> None:
    bare, built = calculated("visibility-map"), calculated("visibility-map", cover=COVER)
    shares = [
        (one["visible_share"], other["visible_share"])
        for one, other in zip(bare["anchors"], built["anchors"], strict=True)
    ]
    assert all(after <= before for before, after in shares)
    assert any(after < before for before, after in shares)


def test_a_path_goes_round_buildings() -> None:
    grid = covered(small_grid(), CoverParameters.model_validate({"cover": COVER}))
    assert grid.standing is not None
    towns = shapely.union_all(grid.standing.outlines)
    path = PRODUCTS["path"].calculate(
        grid, PRODUCTS["path"].parameters.model_validate({**ASKED["path"], "cover": COVER}), Work()
    )
    way = shapely.LineString(np.column_stack([path.column("east_m"), path.column("north_m")]))
    assert way.distance(towns) > 0.0


@pytest.mark.parametrize("name", sorted(ASKED.keys() - {"site-map", "window-map"}))
def test_what_a_job_keeps_of_its_question_has_the_buildings(name: str, tmp_path: Path) -> None:
    product, grid = PRODUCTS[name], small_grid()
    asked = product.parameters.model_validate({**ASKED[name], "cover": COVER})
    unpacked = product.unpacked(product.pack(grid, asked, tmp_path / "inputs"), tmp_path / "inputs")
    standing = covered(grid, unpacked).standing
    assert standing is not None
    assert standing.bodies == len(BLOCKS)


def test_footprints_of_another_body_or_without_a_frame_are_refused() -> None:
    def asked(**members: str) -> CoverParameters:
        town = {**footprints(), **members}
        return CoverParameters.model_validate({"cover": {"footprints": {"geojson": town}}})

    assert covered(small_grid(), asked(body="Earth")).standing is not None
    with pytest.raises(RequestError, match="on Moon, which have no place on a DEM of Earth"):
        covered(small_grid(), asked(body="Moon"))
    with pytest.raises(CoverError, match="'Moon', the grid lies on Earth"):
        parse_footprints({**footprints(), "body": "Moon"}, small_grid())
    local = ElevationGrid(np.zeros((9, 9), np.float32), 10.0, 10.0)
    with pytest.raises(RequestError, match="coordinates_are"):
        covered(local, asked())


@pytest.mark.parametrize("kind", ["visibility-map", "morphing-map"])
def test_a_path_on_a_finished_map_stands_on_the_buildings_of_the_map(kind: str) -> None:
    product = PRODUCTS["path"]
    asked = product.asked.model_validate({"dem_id": "d", "map_id": "m", **path_request(), "anchors": []})
    of_map = PRODUCTS[kind].parameters.model_validate(
        {
            "anchors": ASKED[kind]["anchors"],
            "cover": COVER,
            **({"ceiling_above_ground_m": 300.0} if kind[0] == "m" else {}),
        }
    )
    given = Given(kind, of_map.model_dump(mode="json", exclude_none=True))
    standing = covered(small_grid(), product.completed(asked, given)).standing
    assert standing is not None
    assert standing.bodies == len(BLOCKS)


def test_a_start_inside_a_building_is_told_so() -> None:
    grid = covered(small_grid(), CoverParameters.model_validate({"cover": COVER}))
    product = PRODUCTS["path"]
    asked = product.parameters.model_validate({**path_request(), "start": at(250.0, 230.0)})
    with pytest.raises(PlaceError, match="cannot be stood on: no-go area or building; "):
        product.calculate(grid, asked, Work())


@pytest.mark.parametrize("name", ["site-map", "window-map"])
def test_what_knows_bare_ground_only_refuses_buildings(name: str) -> None:
    with pytest.raises(ValidationError, match="knows bare ground only"):
        PRODUCTS[name].parameters.model_validate({**ASKED[name], "cover": COVER})


def test_probes_profiles_and_detectors_look_at_the_same_ground() -> None:
    grid = small_grid()
    east, behind = {**at(95.0, 229.0), "above_ground_m": 5.0}, {**at(330.0, 229.0), "above_ground_m": 2.0}
    lines = {"pairs": [{"from": east, "to": behind}], "dem_id": "d"}
    verdicts = []
    for changes in ({}, {"cover": COVER}):
        asked = ProfilesIn.model_validate({**lines, **changes})
        verdicts.append(profiles(covered(grid, asked), asked).profiles[0].verdict)
    assert verdicts == ["clear", "blocked"]
    seen = []
    for changes in ({}, {"cover": COVER}):
        body = {"dem_id": "d", "points": [at(330.0, 229.0)], "anchors": [{"id": "A", **east}], **changes}
        place = ProbeIn.model_validate(body)
        seen.append(probe(covered(grid, place), place).points[0].visible_anchors)
    assert seen == [1, 0]
    anchors = [{"id": n, **at(95.0 + 9.0 * i, 229.0), "altitude_m": 30.0} for i, n in enumerate("ABCD")]
    session = DetectorIn.model_validate({"anchors": anchors, "dem_id": "d", "cover": COVER})
    looked_at = memory_of(session, covered(grid, session)).detector._mapped().grid
    assert looked_at.standing is not None
    assert looked_at.standing.bodies == len(BLOCKS)
    with pytest.raises(ValidationError, match="A cover stands on a DEM"):
        DetectorIn.model_validate({"anchors": anchors, "cover": COVER})


def test_probes_and_lines_tell_what_was_assumed_of_buildings() -> None:
    town = footprints()
    town["features"][0]["properties"]["min_height"] = "4"
    cover = {"footprints": {"geojson": town}}
    place, line = at(330.0, 229.0), ASKED["lines-of-sight"]["pairs"]
    asked = ProbeIn.model_validate({"dem_id": "d", "points": [place], "cover": cover})
    lines = ProfilesIn.model_validate({"dem_id": "d", "pairs": line, "cover": cover})
    warned = [
        probe(covered(small_grid(), asked), asked).warnings,
        profiles(covered(small_grid(), lines), lines).warnings,
    ]
    assert [any("count as solid below" in one for one in told) for told in warned] == [True, True]


def test_a_request_without_heights_is_refused_and_levels_are_taken_when_asked() -> None:
    grid = small_grid()
    bare = footprints()
    bare["features"][1]["properties"] = {"building": "yes", "building:levels": "3"}

    def asked(**more: Any) -> CoverParameters:
        return CoverParameters.model_validate({"cover": {"footprints": {"geojson": bare, **more}}})

    with pytest.raises(CoverError, match="the first is way/1"):
        covered(grid, asked())
    built = covered(grid, asked(level_m=3.0))
    assert any("taken as 3.0 m each, as asked: " in warning for warning in built.provenance.warnings)
    with pytest.raises(ValidationError, match="needs footprints, meshes or a canopy"):
        CoverParameters.model_validate({"cover": {}})


def test_roofs_of_the_covered_ground_are_where_the_footprints_are() -> None:
    grid = covered(small_grid(), CoverParameters.model_validate({"cover": COVER}))
    assert grid.standing is not None
    areas_m2 = sorted(outline.area for outline in grid.standing.outlines)
    np.testing.assert_allclose(areas_m2, [1600.0] * 4, rtol=1e-6)


@pytest.mark.parametrize("name", [".", "..", " . ", "a\0b.tif", "a\nb.tif", "\ud800.tif", "𝒳" * 60])
def test_a_raster_whose_name_no_file_can_have_is_refused(name: str) -> None:
    raster = {"name": name, "base64": base64.b64encode(b"heights").decode()}
    with pytest.raises(ValidationError, match="name"):
        CoverIn.model_validate({"canopy": {"heights": raster}})
    assert CoverIn.model_validate({"canopy": {"heights": {**raster, "name": "Bäume 2026.tif"}}}).canopy is not None
