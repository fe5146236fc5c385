"""Requests are strict, and what is wrong with them is said in one sentence that names the place."""

import json
import math

import pytest
from pydantic import ValidationError

from service.parts.anchors import AnchorIn
from service.parts.sentences import sentence_of
from service.products.visibility.request import VisibilityMapParameters

ANCHOR = {"id": "D1", "east_m": 1.0, "north_m": 2.0, "above_ground_m": 80.0}


def complaint(model, fields):
    with pytest.raises(ValidationError) as caught:
        model.model_validate(fields)
    return sentence_of(caught.value)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"altitude_m": 5.0}, "Anchor D1: give exactly one of above_ground_m and altitude_m; both were given."),
        (
            {"above_ground_m": None},
            "Anchor D1: give exactly one of above_ground_m and altitude_m; neither was given.",
        ),
        ({"lon_deg": 3.0}, "Anchor D1: give exactly one of the pairs east_m, north_m or lon_deg, lat_deg."),
        (
            {"lon_deg": 3.0, "lat_deg": 4.0},
            "Anchor D1: give exactly one of the pairs east_m, north_m or lon_deg, lat_deg.",
        ),
        ({"north_m": None}, "Anchor D1: give exactly one of the pairs east_m, north_m or lon_deg, lat_deg."),
        ({"east_m": math.nan}, "east_m: Input should be a finite number."),
        ({"north_m": math.inf}, "north_m: Input should be a finite number."),
        ({"east_m": "12"}, "east_m: Input should be a valid number."),
        ({"east_m": True}, "east_m: Input should be a valid number."),
        ({"above_ground_m": -1.0}, "above_ground_m: Input should be greater than or equal to 0."),
        ({"height": 80.0}, "height: this field is not known here."),
        ({"id": ""}, "id: String should have at least 1 character."),
        ({"id": "a\nb"}, "id: an id has no control characters, no line breaks and no blanks at its beginning and end."),
        ({"azimuth_from_deg": 10.0}, "Anchor D1: An azimuth sector needs both its start and its end."),
        (
            {"min_range_m": 50.0, "max_range_m": 20.0},
            "Anchor D1: Range limits must satisfy 0 <= 50.0 m < 20.0 m.",
        ),
        (
            {"min_elevation_deg": 10.0, "max_elevation_deg": -10.0},
            "Anchor D1: Elevation limits must satisfy -90 deg <= min < max <= 90 deg, not 10 and -10 deg.",
        ),
        ({"ranging_sigma_m": -0.1}, "ranging_sigma_m: Input should be greater than or equal to 0."),
    ],
)
def test_a_bad_anchor_is_refused_in_one_sentence(change, sentence):
    assert complaint(AnchorIn, {**ANCHOR, **change}) == sentence


@pytest.mark.parametrize(("lat_deg", "lon_deg"), [(90.5, 0.0), (0.0, 361.0), (-91.0, 0.0), (0.0, -181.0)])
def test_degrees_beyond_the_globe_are_refused(lat_deg, lon_deg):
    assert "_deg: Input should be" in complaint(
        AnchorIn, {"id": "D1", "lat_deg": lat_deg, "lon_deg": lon_deg, "altitude_m": 0.0}
    )


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"anchors": []}, "anchors: List should have at least 1 item, not 0."),
        ({"anchors": [ANCHOR, ANCHOR]}, "Anchor ids must be unique; repeated: D1."),
        (
            {"receiver_altitude_m": 5.0, "receiver_above_ground_m": 1.0},
            "Give exactly one of receiver_above_ground_m and receiver_altitude_m; both were given.",
        ),
        (
            {"receiver_above_ground_m": None},
            "Give exactly one of receiver_above_ground_m and receiver_altitude_m; neither was given.",
        ),
        ({"receiver_above_ground_m": -0.5}, "receiver_above_ground_m: Input should be greater than or equal to 0."),
        ({"mode": "best"}, "mode: Input should be 'fast' or 'exact'."),
        ({"unknown": "clear"}, "unknown: Input should be 'unknown', 'open' or 'blocked'."),
        ({"curvature": "round"}, "curvature: Input should be 'auto' or 'flat'."),
        ({"curvature": {"radius_m": 0.0}}, "curvature.radius_m: Input should be greater than 0."),
        ({"curvature": {"radius_m": 1e6, "k": 1.0}}, "curvature.k: this field is not known here."),
        ({"anchors": [ANCHOR, {**ANCHOR, "id": "D2", "east_m": None}]},
         "Anchor D2: give exactly one of the pairs east_m, north_m or lon_deg, lat_deg."),
        ({"anchors": [{**ANCHOR, "north_m": "x"}]}, "anchors[0].north_m: Input should be a valid number."),
    ],
)  # fmt: skip
def test_a_bad_question_is_refused_in_one_sentence(change, sentence):
    assert complaint(VisibilityMapParameters, {"anchors": [ANCHOR], **change}) == sentence


def test_the_receiver_stands_one_and_a_half_metres_high_unless_told_otherwise():
    assert VisibilityMapParameters.model_validate({"anchors": [ANCHOR]}).receiver_above_ground_m == 1.5


def test_an_altitude_takes_the_place_of_the_default_height():
    asked = VisibilityMapParameters.model_validate({"anchors": [ANCHOR], "receiver_altitude_m": 700.0})
    assert (asked.receiver_above_ground_m, asked.receiver_altitude_m) == (None, 700.0)


def test_parameters_survive_json():
    asked = VisibilityMapParameters.model_validate(
        {"anchors": [ANCHOR], "receiver_altitude_m": 9.0, "curvature": {"radius_m": 1_737_400.0}}
    )
    assert VisibilityMapParameters.model_validate_json(asked.model_dump_json()) == asked


def test_every_field_is_described_and_every_number_has_its_unit():
    schema = VisibilityMapParameters.model_json_schema()
    models = {"VisibilityMapParameters": schema, **schema["$defs"]}
    for name, model in models.items():
        for field, about in model["properties"].items():
            assert about.get("description"), f"{name}.{field}"
            if field.endswith("_m"):
                assert "metre" in about["description"], f"{name}.{field}"
            if field.endswith("_deg"):
                assert "degree" in about["description"] or field == "lat_deg", f"{name}.{field}"


@pytest.mark.parametrize("model", [AnchorIn, VisibilityMapParameters])
def test_the_examples_validate(model):
    for example in model.model_json_schema()["examples"]:
        model.model_validate_json(json.dumps(example))
