"""Which products may be asked for what is usable, what they need for it, and what the others say."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from service.products.registry import PRODUCTS
from tests.service.asked import ASKED
from tests.service.test_signals_of_products import anchors

# products that plan, place or judge with anchors of their own
ASK = sorted(
    {"placement", "repositioning", "path", "window-map", "safety-bubbles", "visibility-map", "dop-map", "morphing-map"}
)


def with_radios(name: str, radio: dict[str, Any]) -> dict[str, Any]:
    """A product's request with a radio for all that it ranges to."""
    lists = [one for one in ("anchors", "tracks") if ASKED[name].get(one)]
    heard: dict[str, Any] = {one: [{**anchor, "radio": radio} for anchor in ASKED[name][one]] for one in lists}
    return {**heard, "sight": "usable", **({"radio": radio} if name == "placement" else {})}


@pytest.mark.parametrize("name", ASK)
def test_usable_is_refused_without_radios(name: str) -> None:
    with pytest.raises(ValidationError, match="not known without a radio"):
        PRODUCTS[name].parameters.model_validate({**ASKED[name], "sight": "usable"})


def test_usable_is_refused_for_satellites_and_a_placement_s_radio_without_it() -> None:
    sky = {"almanac": "x", "time": "2026-01-01T00:00:00Z"}
    for name in ("path", "safety-bubbles", "dop-map"):
        with pytest.raises(ValidationError, match="known of anchors alone"):
            PRODUCTS[name].parameters.model_validate(
                {**ASKED[name], **with_radios(name, {"preset": "uwb"}), "satellites": sky}
            )
    with pytest.raises(ValidationError, match="goes with sight usable"):
        PRODUCTS["placement"].parameters.model_validate({**ASKED["placement"], "radio": "uwb"})


@pytest.mark.parametrize("name", sorted(set(PRODUCTS) - set(ASK)))
def test_products_that_know_sight_alone_say_why(name: str) -> None:
    model = PRODUCTS[name].parameters
    with pytest.raises(ValidationError, match=r"What is usable cannot be asked for here: .* Ask for visible\."):
        model.model_validate({**ASKED[name], "sight": "usable"})
    assert model.model_validate({**ASKED[name], "sight": "visible"})


def test_a_path_above_a_morphing_map_leaves_what_is_usable_to_the_map() -> None:
    above = {**{key: value for key, value in ASKED["path"].items() if key != "anchors"}, "limits": {}}
    air = {"anchors": anchors({"preset": "915MHz"}), "sight": "usable", "ceiling_above_ground_m": 300.0}
    model = PRODUCTS["path"].parameters
    assert model.model_validate({**above, "morphing_map": air})
    with pytest.raises(ValidationError, match="its own sight, in morphing_map"):
        model.model_validate({**above, "morphing_map": air, "sight": "usable"})
