"""Paths asked for under older names, and paths that an older Sightline stored."""

import json

import pytest

from service.jobs.kept_files import load, save
from service.products import Given
from service.products.paths import PATH
from service.products.paths.files import LAYERS
from service.products.paths.request import PathIn
from service.products.registry import PRODUCTS
from tests.service.small_paths import path_request, small_path


@pytest.fixture(scope="module")
def found():
    return small_path(limits={"min_anchors": 1})


def test_a_result_that_an_older_sightline_stored_still_opens(found, tmp_path):
    folder = tmp_path / "kept"
    save(PATH, found, folder)
    told = found.answer.model_dump(mode="json")
    description = json.loads((folder / "path.json").read_text())
    for parameters in (told["parameters"], description["parameters"]):
        parameters["rover"]["antenna_height_m"] = parameters["rover"].pop("receiver_above_ground_m")
        parameters["limits"]["max_dop"] = parameters["limits"].pop("dop_limit", None)
    (folder / "path.json").write_text(json.dumps({**description, "format": 1}))
    (folder / "answer.json").unlink()
    _, again = load(PRODUCTS, folder, told)
    assert again.parameters.model_dump() == found.parameters.model_dump()
    assert again.answer.totals == found.answer.totals
    for layer in LAYERS:
        layer.write(again, tmp_path / layer.name)


def test_a_map_gives_its_limits_under_todays_names_to_a_request_with_older_ones():
    asked = {"dem_id": "D", "map_id": "M", **path_request(anchors=[], rover={"antenna_height_m": 3.0})}
    map_parameters = {
        **{"anchors": path_request()["anchors"], "dop_limit": 7.0, "min_anchors": 2, "measure": "hdop"},
        "receiver_above_ground_m": 2.5,
    }
    whole = PATH.completed(PathIn.model_validate(asked), Given("dop-map", map_parameters))
    assert (whole.rover.receiver_above_ground_m, whole.limits.dop_limit, whole.limits.measure) == (3.0, 7.0, "hdop")
    assert PATH.needs(PathIn.model_validate(asked)).map_id == "M"
