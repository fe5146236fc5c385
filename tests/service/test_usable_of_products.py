"""Which products may be asked for what is usable, what they need for it, and what the others say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import rasterio
from matplotlib.text import Text
from pydantic import ValidationError

from service.cli.asking.by_windows import _table
from service.parts.cover import covered
from service.products import Work
from service.products.in_common import Drawn
from service.products.registry import PRODUCTS
from tests.service.asked import ASKED
from tests.service.small_maps import small_grid
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


def words_of(name: str, sight: str) -> str:
    """All words on the pictures of a product, and the goal that a placement tells."""
    product = PRODUCTS[name]
    asked = {**with_radios(name, {"preset": "868MHz"}), "sight": sight}
    asked = {**ASKED[name], **asked, **({"limits": {"min_anchors": 1}} if name == "path" else {})}
    if sight == "visible":
        asked.pop("radio", None)
    parameters = product.parameters.model_validate(asked)
    finished = product.calculate(covered(small_grid(), parameters), parameters, Work())
    figures = [
        layer.write.function()(finished, **layer.write.more)
        for layer in product.layers
        if isinstance(layer.write, Drawn) and layer.is_of(parameters.model_dump(mode="json", exclude_none=True))
    ]
    texts = [text.get_text() for figure in figures for text in figure.findobj(Text)]
    return "\n".join([*texts, str(getattr(finished.answer, "goal", ""))])


@pytest.mark.parametrize("name", ["visibility-map", "dop-map", "path", "placement", "safety-bubbles"])
def test_pictures_of_what_is_usable_say_so_where_those_of_sight_say_in_sight(name: str) -> None:
    heard, seen = words_of(name, "usable"), words_of(name, "visible")
    if name != "dop-map":  # a map of dilutions counts nobody unless cuts are asked for
        assert ("usable" in heard, "sight" in seen) == (True, True)
    assert "sight" not in heard.replace("Sightline", "")
    assert "usable" not in seen


def test_a_map_by_windows_says_usable_in_its_table_and_its_files(tmp_path: Path) -> None:
    product = PRODUCTS["window-map"]
    for sight, word in (("usable", "usable"), ("visible", "in sight")):
        asked = {**ASKED["window-map"], **with_radios("window-map", {"preset": "868MHz"}), "sight": sight}
        parameters = product.parameters.model_validate(asked)
        finished = product.calculate(small_grid(), parameters, Work(folder=tmp_path))
        heads = [str(column.header).replace("\n", " ") for column in _table(finished.answer).columns]
        assert (sight in heads, "hidden" in heads) == (True, sight == "visible")
        with rasterio.open(Path(finished.folder) / "min_visible_altitude.tif") as lowest:
            assert lowest.descriptions == (f"lowest altitude with one {word}",)
        with rasterio.open(Path(finished.folder) / "count.tif") as count:
            assert count.descriptions == (f"{sight} anchors", "unknown anchors")
