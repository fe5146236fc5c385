"""What is usable over HTTP: the products that know it answer by signals, from what the radios say."""

from __future__ import annotations

from typing import Any

import pytest

from service.products.registry import PRODUCTS
from tests.service.http.test_bad_requests import assert_problem
from tests.service.http.test_every_product import posted
from tests.service.running import Server
from tests.service.small_paths import ANCHORS, at
from tests.service.test_usable_of_products import with_radios

DEAF, STRONG = {"preset": "868MHz", "sensitivity_dbm": 50.0}, {"preset": "915MHz"}
STANDING: dict[str, dict[str, Any]] = {"placement": {"count": 2}, "repositioning": {"occluded": []}}


def result(server: Server, ground: dict[str, Any], name: str, **more: Any) -> dict[str, Any]:
    answer = posted(server, PRODUCTS[name], ground, **STANDING.get(name, {}), **more)
    assert answer.status_code == 201, answer.text
    told: dict[str, Any] = answer.json()["result"]
    assert not any("Not looked at" in warning for warning in told.get("warnings", []))
    return told


def heard(name: str, told: dict[str, Any]) -> float:
    """How much of what is asked about is usable, in any unit that grows with it."""
    if name == "placement":
        return float(told["exact_share"])
    if name == "repositioning":
        return float(told["before_share"])
    if name == "window-map":
        return float(sum(one["visible_posts"] for one in told["anchors"]))
    if name == "safety-bubbles":
        return -float(told["radius_quantiles_m"]["p50"])
    return -float(told["totals"]["out_of_sight_s"])


@pytest.mark.parametrize("name", ["placement", "repositioning", "window-map", "safety-bubbles", "path"])
def test_a_strong_radio_is_heard_behind_the_wall_and_a_deaf_one_nowhere(
    server: Server, ground: dict[str, Any], name: str
) -> None:
    limits = {"limits": {}} if name == "path" else {}
    seen = result(server, ground, name, **limits)
    strong, deaf = (result(server, ground, name, **with_radios(name, radio), **limits) for radio in (STRONG, DEAF))
    assert heard(name, strong) >= heard(name, seen) > heard(name, deaf)
    assert heard(name, strong) > heard(name, deaf)


def test_a_canopy_takes_what_a_weak_radio_had(server: Server, ground: dict[str, Any]) -> None:
    weak = {"preset": "868MHz", "sensitivity_dbm": -80.0}
    cover = {"canopy": {"top_m": 20.0, "model": "density", "depth_per_m": 0.3}}
    asked = with_radios("safety-bubbles", weak)
    low = {"points": [{**at(100.0 + 20.0 * n, 300.0), "above_ground_m": 2.0} for n in range(9)]}
    bare, wooded = (result(server, ground, "safety-bubbles", **asked, **low, **more) for more in ({}, {"cover": cover}))
    assert wooded["radius_quantiles_m"]["p50"] > bare["radius_quantiles_m"]["p50"]


def test_a_flight_and_a_path_stay_above_a_morphing_map_of_what_is_usable(
    server: Server, ground: dict[str, Any]
) -> None:
    air = {"ceiling_altitude_m": 400.0, "dop_limit": 30.0, "min_anchors": 3, "sight": "usable"}
    statuses = []
    for radio in (STRONG, DEAF):
        above = {**air, "anchors": [{**one, "radio": radio} for one in ANCHORS]}
        high = {"start": {**at(100.0, 400.0), "altitude_m": 300.0}, "goal": {**at(750.0, 70.0), "altitude_m": 350.0}}
        product = PRODUCTS["flight"]
        answer = posted(server, product, ground, **high, morphing_map=above)
        statuses.append(answer.json()["result"]["status"] if answer.status_code == 201 else answer.status_code)
        way = {"anchors": [], "limits": {}, "morphing_map": {**above, "min_anchors": 3}}
        driven = posted(server, PRODUCTS["path"], ground, **way)
        statuses.append(driven.json()["result"]["status"] if driven.status_code == 201 else driven.status_code)
    assert statuses[0] == "found", statuses
    assert statuses[2] != "found", statuses
    assert statuses[3] != "found", statuses


def test_a_path_on_a_finished_map_of_what_is_usable_is_of_what_is_usable(
    server: Server, ground: dict[str, Any]
) -> None:
    asked = with_radios("visibility-map", STRONG)
    made = posted(server, PRODUCTS["visibility-map"], ground, **asked).json()
    answer = posted(server, PRODUCTS["path"], ground, anchors=[], map_id=made["id"], limits={"min_anchors": 3})
    assert answer.status_code == 201, answer.text
    told = answer.json()["result"]
    assert told["parameters"]["sight"] == "usable"
    assert (told["status"], told["totals"]["fewest_anchors"]) == ("found", 3)
    seen = posted(server, PRODUCTS["path"], ground, limits={"min_anchors": 3})
    assert "of the 3 anchors asked for are in sight there" in seen.text


def test_what_knows_sight_alone_refuses_usable_with_its_reason(server: Server, ground: dict[str, Any]) -> None:
    refused = posted(server, PRODUCTS["site-map"], ground, sight="usable")
    assert_problem(refused, 422, "validation", "a map of sites has no anchors whose radios it could know")
