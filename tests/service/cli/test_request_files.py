"""--request FILE takes what HTTP takes, in all commands; what names a thing of a service is passed over, and told."""

import json
import re
from pathlib import Path

import pytest

import service.cli.asking.by_windows
import service.cli.asking.products
from service.cli.asking.products import request_from_file
from service.errors import RequestError
from service.products import Given
from service.products.paths import PATH
from service.products.registry import PRODUCTS
from tests.house.repository import ROOT
from tests.service.asked import ASKED
from tests.service.layer_files import assert_opens
from tests.service.small_paths import path_request

COMMANDS = {
    "visibility-map": "visibility",
    "window-map": "visibility --windows",
    "dop-map": "dop",
    "morphing-map": "morph",
    "path": "plan",
    "flight": "fly",
    "site-map": "sites",
    "placement": "place",
    "repositioning": "reposition",
    "lines-of-sight": "los",
    "safety-bubbles": "bubble",
    "protection-levels": "protect",
    "navigation": "navigate --dem",
}
DEM_ID = "0" * 32
BODY = re.compile(r"127\.0\.0\.1:8000(/[a-z-]+) [^\n]*-d '(.*?)' -o", re.DOTALL)
PAGES = ("docs/http-api.md", "docs/flights.md")


def shown_requests():
    """(product, body) of every request for a product that the pages about HTTP show."""
    paths = {product.path: product for product in PRODUCTS.values()}
    texts = [(ROOT / page).read_text(encoding="utf-8") for page in PAGES]
    found = [pair for text in texts for pair in BODY.findall(text) if pair[0] in paths]
    return [(paths[path], json.loads(body.replace("'$dem'", DEM_ID))) for path, body in found if "$map" not in body]


SHOWN = shown_requests()


def test_the_pages_show_a_request_for_every_product_and_each_has_a_command():
    assert {product.name for product, _ in SHOWN} == set(PRODUCTS) == set(COMMANDS)


@pytest.mark.parametrize(("product", "body"), SHOWN, ids=[product.name for product, _ in SHOWN])
def test_a_command_asks_what_the_same_request_asks_over_http(product, body, sightline, dem_file, tmp_path, monkeypatch):
    asked = []

    def ask(product, dem, request, tables, **_):
        parameters = request if not hasattr(request, "read_text") else request_from_file(request, product)
        asked.append((product.name, parameters))

    monkeypatch.setattr(service.cli.asking.products, "ask", ask)
    monkeypatch.setattr(service.cli.asking.by_windows, "ask", ask)
    file = tmp_path / "request.json"
    file.write_text(json.dumps(body))
    ended = sightline(*COMMANDS[product.name].split(), dem_file, "--request", file)
    assert (ended.code, ended.stdout) == (0, "")
    over_http = product.completed(product.asked.model_validate_json(json.dumps(body)), Given())
    assert asked == [(product.name, over_http)]
    assert ended.stderr == (
        "Warning: The request request.json names a dem_id of a service; it is passed over for the command line's.\n"
    )


@pytest.mark.parametrize("product", PRODUCTS.values(), ids=list(PRODUCTS))
def test_one_rule_for_a_dem_id_in_all_commands(product, tmp_path, capsys):
    body = next(body for shown, body in SHOWN if shown is product)
    file = tmp_path / "request.json"
    file.write_text(json.dumps(body))
    with_id = request_from_file(file, product)
    assert "names a dem_id of a service; it is passed over" in capsys.readouterr().err
    file.write_text(json.dumps({name: value for name, value in body.items() if name != "dem_id"}))
    assert request_from_file(file, product) == with_id
    assert capsys.readouterr() == ("", "")
    file.write_text(json.dumps({**body, "dem": 1}))
    with pytest.raises(RequestError, match=r"^The request request\.json: dem: this field is not known here"):
        request_from_file(file, product)


@pytest.mark.parametrize("product", PRODUCTS.values(), ids=list(PRODUCTS))
def test_a_request_is_answered_and_all_files_of_its_answer_are_written(product, sightline, dem_file, tmp_path):
    file, out = tmp_path / "request.json", tmp_path / "out"
    file.write_text(json.dumps(ASKED[product.name]))
    told = sightline(*COMMANDS[product.name].split(), dem_file, "--request", file, "--out", out, "--json").told()
    written = {path.name for path in out.iterdir()}
    assert {Path(name).name for name in told.pop("files")} == written
    (summary,) = written.difference(product.layer)
    assert json.loads((out / summary).read_text()) == told
    assert product.answer.model_validate(told).model_dump(mode="json") == told
    assert len(written) > 1
    for name in written - {summary}:
        assert_opens(product.layer[name], (out / name).read_bytes())


def test_a_map_id_is_passed_over_only_for_a_map_of_the_command_line(tmp_path, capsys):
    file = tmp_path / "request.json"
    file.write_text(json.dumps({"map_id": "M", **path_request(anchors=[], limits={})}))
    with pytest.raises(RequestError, match="by its map_id; give its file with --map"):
        request_from_file(file, PATH)
    anchors = path_request()["anchors"]
    on = Given(map_kind="visibility-map", map_parameters={"anchors": anchors, "mode": "fast"})
    assert [anchor.id for anchor in request_from_file(file, PATH, on).anchors] == [one["id"] for one in anchors]
    assert "names a map_id of a service" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "sentence"), [("{", "is not JSON"), ("[]", "holds no JSON object"), ('{"seed": -1}', "request.json: ")]
)
def test_what_is_no_request_is_refused_in_a_sentence(text, sentence, tmp_path):
    file = tmp_path / "request.json"
    file.write_text(text)
    with pytest.raises(RequestError, match=sentence):
        request_from_file(file, PATH)


def test_many_lines_come_as_a_request_and_leave_as_files(sightline, tmp_path):
    body = next(body for product, body in SHOWN if product.name == "lines-of-sight")
    file, out = tmp_path / "lines.json", tmp_path / "out"
    file.write_text(json.dumps(body))
    valley = ROOT / "dem_samples" / "valley.npz"
    ended = sightline("los", valley, "--request", file, "--out", out, "--json")
    told = ended.told()
    assert (told["lines"], told["clear"]) == (1, 1)
    assert json.loads((out / "lines.json").read_text())[0]["verdict"] == "clear"
    refused = sightline("los", valley, "--from", "647000,5136200,90agl", "--to", "648000,5136200,9agl", "--out", out)
    assert (refused.code, "--out goes with --request" in refused.stderr) == (2, True)
