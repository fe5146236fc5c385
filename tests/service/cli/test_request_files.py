"""One rule for --request FILE in all commands: what names a thing of a service is passed over, and that is told."""

import json

import pytest
from service.cli.request_files import request_from_file

from service.errors import RequestError
from service.products.flights.request import FlightParameters
from service.products.paths.request import PathQuestion
from service.products.placements.request import PlacementParameters
from service.products.repositionings.request import RepositioningParameters
from tests.service.small_flights import flight_request
from tests.service.small_paths import ANCHORS, at, path_request

PLACEMENT = {"count": 2, "candidates": [{"spacing_m": 200.0, "above_ground_m": [60.0]}]}
REPOSITIONING = {
    "occluded": ["E"],
    "anchors": ANCHORS,
    "rover": {"place": at(200.0, 300.0), "heading_deg": 69.0, "ahead_m": 150.0},
    "flight": {"max_flight_m": 500.0},
}


@pytest.mark.parametrize(
    ("kind", "asked"),
    [
        (PathQuestion, path_request()),
        (FlightParameters, flight_request()),
        (PlacementParameters, PLACEMENT),
        (RepositioningParameters, REPOSITIONING),
    ],
)
def test_a_dem_id_is_passed_over_and_told(kind, asked, tmp_path, capsys):
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"dem_id": "0" * 32, **asked}))
    assert request_from_file(file, kind) == kind.model_validate(asked)
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err == (
        "Warning: The request request.json names a dem_id of a service; it is passed over for the command line's.\n"
    )
    file.write_text(json.dumps(asked))
    request_from_file(file, kind)
    assert capsys.readouterr().err == ""


def test_a_map_id_is_passed_over_only_for_a_map_of_the_command_line(tmp_path, capsys):
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"map_id": "M", **path_request()}))
    with pytest.raises(RequestError, match="by its map_id; give its file with --map"):
        request_from_file(file, PathQuestion)
    request_from_file(file, PathQuestion, instead=("map_id",))
    assert "names a map_id of a service" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "sentence"), [("{", "is not JSON"), ("[]", "holds no JSON object"), ('{"seed": -1}', "request.json: ")]
)
def test_what_is_no_request_is_refused_in_a_sentence(text, sentence, tmp_path):
    file = tmp_path / "request.json"
    file.write_text(text)
    with pytest.raises(RequestError, match=sentence):
        request_from_file(file, PathQuestion)
