"""A cut's picture shows the section that the library answers, class by class."""

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex

from service.products.dop.calculate import calculate_dop_map
from service.products.dop.picture import COLOURS, GROUND, OUTSIDE, draw_cut
from service.products.dop.request import DopMapParameters
from tests.service.cli.positioning_words import PLACES
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility import altitude_layers, control_volume
from visibility.air import vertical_section

LINE = [(WEST_M + 60.0, NORTH_M - 320.0), (WEST_M + 700.0, NORTH_M - 40.0)]


@pytest.fixture(scope="module")
def finished():
    asked = {
        "anchors": [
            {"id": name, "east_m": WEST_M + e, "north_m": NORTH_M + n, "above_ground_m": h}
            for name, (e, n, h) in PLACES.items()
        ],
        "dop_limit": 3.0,
        "volume": {"ceiling_altitude_m": 300.0, "floor_m": 0.0, "layer_m": 20.0},
        "cuts": [
            {"line": [{"east_m": east_m, "north_m": north_m} for east_m, north_m in LINE]},
            {"altitude_m": 40.0},
            {"above_ground_m": 10.0},
        ],
    }
    return calculate_dop_map(small_grid(), DopMapParameters.model_validate(asked))


def test_a_vertical_cut_shows_each_voxel_in_the_colour_of_its_class(finished):
    volume = control_volume(finished.surfaces(), altitude_layers(0.0, 300.0, 20.0))
    cut = vertical_section(volume, LINE)
    figure = draw_cut(finished, 0)
    figure.canvas.draw()
    panels = [axes for axes in figure.axes if any(isinstance(child, QuadMesh) for child in axes.get_children())]
    assert len(panels) == 2
    mesh = next(child for child in panels[1].get_children() if isinstance(child, QuadMesh))
    shown = mesh.get_facecolors().reshape(*cut.dop.shape, 4)
    in_air = ~cut.below_ground
    bounds = 3.0 * np.array([0.0, 0.5, 0.75, 1.0, 2.0, np.inf])
    for low, high, colour in zip(bounds[:-1], bounds[1:], COLOURS, strict=True):
        here = in_air & (cut.dop >= low) & (cut.dop < high)
        assert {to_hex(rgba) for rgba in shown[here]} <= {colour}
    assert (shown[cut.below_ground][:, 3] == 0.0).all(), "the ground shows through"
    assert panels[1].get_ylim() == (-10.0, 310.0)
    assert panels[1].get_xlim()[1] == pytest.approx(np.hypot(640.0, 280.0) / 1000.0, rel=0.05)


@pytest.mark.parametrize(
    ("volume", "outside"),
    [
        ({"ceiling_above_ground_m": 60.0}, True),
        ({"ceiling_above_ground_m": 60.0, "floor_m": 30.0}, True),
        ({"ceiling_altitude_m": 300.0, "floor_m": 0.0}, False),
    ],
    ids=["ceiling over ground", "floor over ground", "level layers from below the ground"],
)
def test_air_beyond_floor_and_ceiling_is_no_ground(volume, outside):
    anchors = [
        {"id": name, "east_m": WEST_M + e, "north_m": NORTH_M + n, "above_ground_m": h}
        for name, (e, n, h) in PLACES.items()
    ]
    line = {"line": [{"east_m": east_m, "north_m": north_m} for east_m, north_m in LINE]}
    asked = DopMapParameters.model_validate({"anchors": anchors, "volume": {"layer_m": 20.0, **volume}, "cuts": [line]})
    figure = draw_cut(calculate_dop_map(small_grid(), asked), 0)
    figure.canvas.draw()
    painted = np.asarray(figure.canvas.buffer_rgba())
    panels = [axes for axes in figure.axes if any(isinstance(child, QuadMesh) for child in axes.get_children())]
    for axes in panels:
        words = [text.get_text() for text in axes.get_legend().get_texts()]
        assert ("outside the volume" in words) == outside
        (west, east), (_, highest_m) = axes.get_xlim(), axes.get_ylim()
        # the wall of the small ground is higher than all the rest: beside it there is air under the highest ceiling
        x, y = axes.transData.transform((west + 0.03 * (east - west), highest_m - 1.0))
        shown = to_hex(painted[painted.shape[0] - 1 - int(y), int(x)] / 255.0)
        assert (shown == OUTSIDE.colour) == outside
        assert shown != GROUND.colour


@pytest.mark.parametrize(("number", "rock"), [(1, True), (2, False)])
def test_a_horizontal_cut_shows_ground_only_where_it_is_higher(finished, number, rock):
    figure = draw_cut(finished, number)
    maps = [axes for axes in figure.axes if axes.get_images()]
    assert len(maps) == 2
    for axes in maps:
        legend = [text.get_text() for text in axes.get_legend().get_texts()]
        assert ("ground" in legend) == rock
        assert "unknown" in legend, "the hole hides sight lines"
        west, east, south, north = axes.get_images()[0].get_extent()
        assert (west, north) == pytest.approx(((WEST_M - 15.0) / 1000.0, (NORTH_M + 10.0) / 1000.0))
        assert (east - west, north - south) == pytest.approx((0.9, 0.48))
