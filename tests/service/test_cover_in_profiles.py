"""Profiles of flights and of safety bubbles show what stands under the way: roofs and crowns at their altitudes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from service.parts.cover import CoverParameters, covered
from service.products.flights.calculate import calculate_flight
from service.products.flights.picture import draw_flight_profile
from service.products.flights.request import FlightParameters
from service.products.safety_bubbles.calculate import calculate_bubbles
from service.products.safety_bubbles.picture import draw_bubble_profile
from service.products.safety_bubbles.request import BubbleParameters
from tests.service.asked import ASKED
from tests.service.small_flights import HIGH, flight_request
from tests.service.small_maps import small_grid
from tests.service.small_paths import ANCHORS, at
from tests.service.test_cover_of_products import BLOCKS, COVER

CROWNS_M, BASES_M = 12.0, 4.0
WOODED = {**COVER, "canopy": {"top_m": CROWNS_M, "base_m": BASES_M}}


def ground_m(east_m: float, south_m: float) -> float:
    """Of the slope west of the wall."""
    return south_m / 20.0 + 0.5 * east_m / 30.0


def drawn(axes: Axes, label: str) -> npt.NDArray[np.float64]:
    """(n, 2) corners of what has that label."""
    (found,) = (one for one in axes.collections if one.get_label() == label)
    assert isinstance(found, PolyCollection)
    return np.concatenate([path.vertices for path in found.get_paths()])


def in_legend(axes: Axes) -> set[str]:
    legend = axes.get_legend()
    assert legend is not None
    return {text.get_text() for text in legend.get_texts()}


def bubble_profile(**changes: Any) -> Figure:
    asked = BubbleParameters.model_validate({**ASKED["safety-bubbles"], **changes})
    return draw_bubble_profile(calculate_bubbles(covered(small_grid(), asked), asked))


def test_a_bubble_s_profile_has_the_block_and_the_trees_under_its_way() -> None:
    axes = bubble_profile(cover=WOODED).axes[1]
    # the way runs east from 100 m, over the third block, from 160 to 200 m
    west_m, south_m, height_m = BLOCKS[2]
    roof_m = ground_m(west_m + 20.0, south_m + 20.0) + height_m
    along_m, up_m = drawn(axes, "buildings").T
    np.testing.assert_allclose([along_m.min(), along_m.max()], [west_m - 100.0, west_m - 60.0], atol=0.3)
    np.testing.assert_allclose(up_m.max(), roof_m, atol=1e-2)
    trees = drawn(axes, "trees")
    far = trees[trees[:, 0] == trees[:, 0].max(), 1]
    np.testing.assert_allclose(
        [far.min(), far.max()], ground_m(260.0, 300.0) + np.array([BASES_M, CROWNS_M]), atol=0.02
    )
    assert in_legend(axes) == {"ground", "buildings", "trees", "way", "bubble"}
    bare = bubble_profile().axes[1]
    assert in_legend(bare) == {"ground", "way", "bubble"}


def test_a_bubble_of_any_size_leaves_the_ground_to_be_seen() -> None:
    axes = bubble_profile(initial_position_sigma_m=5000.0, anchors=ANCHORS[:1]).axes[1]
    low_m, high_m = axes.get_ylim()
    assert drawn(axes, "bubble")[:, 1].max() > high_m + 1000.0
    assert ground_m(100.0, 300.0) - 20.0 < low_m < high_m < ground_m(260.0, 300.0) + 60.0


def test_a_flight_s_profile_has_the_block_and_the_trees_below_it() -> None:
    asked = FlightParameters.model_validate(flight_request(**HIGH, cover=WOODED))
    finished = calculate_flight(covered(small_grid(), CoverParameters(cover=asked.cover)), asked)
    assert len(finished.corners_m) == 2, "straight over the second block, corner to corner of its sides"
    high = draw_flight_profile(finished).axes[0]
    west_m, south_m, height_m = BLOCKS[1]
    flown_per_east = math.hypot(1.0, 330.0 / 650.0, 50.0 / 650.0)
    edges_km = (np.array([west_m, west_m + 40.0]) - 100.0) * flown_per_east / 1000.0
    along_km, up_m = drawn(high, "buildings").T
    np.testing.assert_allclose([along_km.min(), along_km.max()], edges_km, atol=0.006)
    np.testing.assert_allclose(up_m.max(), ground_m(west_m + 20.0, south_m + 20.0) + height_m, atol=1e-2)
    begin = drawn(high, "trees")
    begin = begin[begin[:, 0] == 0.0, 1]
    np.testing.assert_allclose(begin.max(), ground_m(100.0, 400.0) + CROWNS_M, atol=0.02)
    assert {"ground", "buildings", "trees", "flight"} <= in_legend(high)
    assert not [told for told in finished.answer.warnings if "trees" in told]


def test_a_flight_through_crowns_says_so() -> None:
    low = {"start": {**at(100.0, 400.0), "above_ground_m": 20.0}, "goal": {**at(400.0, 400.0), "above_ground_m": 20.0}}
    tall = {"canopy": {"top_m": 30.0, "base_m": 4.0}}
    asked = FlightParameters.model_validate(flight_request(**low, cover=tall))
    finished = calculate_flight(covered(small_grid(), asked), asked)
    (told,) = (one for one in finished.answer.warnings if "trees" in one)
    assert finished.answer.totals is not None
    whole_m = finished.answer.totals.length_m
    assert told == (
        f"The flight leads through {whole_m:.0f} m of trees: it keeps its distance to ground and buildings alone."
    )
