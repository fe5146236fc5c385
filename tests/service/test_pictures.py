"""The picture shows the map: colours where the classes are, and everything a reader needs."""

import warnings
from dataclasses import replace

import numpy as np
import pyproj
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from service.cli.visibility import count_table
from service.drawing.class_map import NO_GROUND_COLOUR, NONE_COLOUR, UNKNOWN_COLOUR, count_classes, lookup_table
from service.drawing.furniture import draw_scale_and_north
from service.drawing.sheet import Sampling, mean_heights, pick, shaded_relief
from service.parts.map_facts import grid_north_deg
from service.products.visibility.picture import draw_map
from terrain import ElevationGrid
from tests.service.small_maps import HOLE, ROWS, small_map
from visibility import Anchor


def pixels(figure):
    """The whole picture, (rows, cols, 3) in 0..1."""
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255.0


def map_pixels(figure):
    """The raster inside the axes as it was given, before anything was drawn over it."""
    return np.asarray(figure.axes[0].images[0].get_array()) / 255.0


def texts(figure):
    axes = figure.axes[0]
    legend = axes.get_legend()
    inside = [text.get_text() for text in [*axes.texts, *legend.get_texts(), legend.get_title()]]
    return [*inside, *(text.get_text() for text in figure.texts), axes.get_xlabel(), axes.get_ylabel()]


@pytest.fixture(scope="module")
def finished():
    return small_map()


@pytest.fixture(scope="module")
def figure(finished):
    return draw_map(finished)


def test_the_picture_is_not_blank(figure):
    seen = pixels(figure)
    assert len(np.unique((seen * 255).astype(int).reshape(-1, 3), axis=0)) > 50
    assert 0.2 < (seen < 0.98).any(axis=2).mean() < 0.95


def test_each_post_has_the_hue_of_its_count(finished, figure):
    drawn = map_pixels(figure)
    repeat = drawn.shape[0] // ROWS
    centres = drawn[repeat // 2 :: repeat, repeat // 2 :: repeat]
    table = lookup_table(count_classes(3))
    certain = finished.unknown_count == 0
    for row, col in np.argwhere(certain):
        shade = centres[row, col] / table[finished.count[row, col]]
        assert np.ptp(shade) < 0.03, "relief darkens a colour, it never changes it"
        assert 0.3 < shade.mean() <= 1.01


def test_ground_that_is_not_known_is_pale_and_not_shaded(figure):
    drawn = map_pixels(figure)
    repeat = drawn.shape[0] // ROWS
    hole = drawn[HOLE[0].start * repeat : HOLE[0].stop * repeat, HOLE[1].start * repeat : HOLE[1].stop * repeat]
    assert np.abs(hole - to_rgb(NO_GROUND_COLOUR)).max() < 0.01


def test_sight_that_is_not_known_is_hatched_grey(finished, figure):
    drawn = map_pixels(figure)
    repeat = drawn.shape[0] // ROWS
    unknown = (finished.count == 0) & (finished.unknown_count > 0) & ~np.isnan(finished.grid.heights_m)
    assert unknown.any()
    cells = drawn[unknown.repeat(repeat, 0).repeat(repeat, 1)]
    grey = np.abs(cells - to_rgb(UNKNOWN_COLOUR)).max(axis=1) < 0.01
    assert 0.5 < grey.mean() < 0.95
    assert np.abs(cells - cells[:, :1]).max() < 0.01


def test_title_names_the_ground_the_receiver_and_the_mode(figure):
    said = " ".join(texts(figure))
    assert "small.tif" in said
    assert "receiver 1.5 m above ground" in said
    assert "mode fast" in said
    assert "3 anchors" in said


def test_axes_are_in_kilometres_of_the_grids_frame(figure):
    axes = figure.axes[0]
    assert axes.get_xlabel() == "east, km  (EPSG:32611)"
    assert axes.get_ylabel() == "north, km"
    assert axes.get_xlim() == pytest.approx((399.985, 400.885))
    assert axes.get_ylim() == pytest.approx((3799.530, 3800.010))


def test_scale_bar_is_as_long_as_it_says(figure):
    axes = figure.axes[0]
    assert "200 m" in texts(figure) or "100 m" in texts(figure)
    length_km = 0.2 if "200 m" in texts(figure) else 0.1
    halves = [patch for patch in axes.patches if patch.get_alpha() is None]
    assert sum(patch.get_width() for patch in halves) * 0.9 == pytest.approx(length_km)


def test_north_and_every_anchor_have_their_name(figure):
    said = texts(figure)
    assert {"N", "west", "east"} <= set(said)
    assert "outside\n885 m off" in said  # from the picture's border


def test_an_anchor_outside_is_an_arrow_and_inside_a_triangle(figure):
    markers = [line for line in figure.axes[0].lines if line.get_marker() == "^"]
    assert sorted(float(line.get_xdata()[0]) for line in markers) == [400.095, 400.75]


def test_legend_has_a_class_per_count_with_shares_that_make_up_the_known_ground(figure):
    legend = figure.axes[0].get_legend()
    labels = [text.get_text() for text in legend.get_texts()]
    assert [label.split()[0] for label in labels] == ["3", "2", "1", "0", "unknown", "no", "anchor"]
    assert sum(float(label.split()[1]) for label in labels[:5]) == pytest.approx(100.0, abs=0.3)
    assert labels[5] == "no ground"
    assert legend.get_title().get_text().endswith("share of known posts")


def test_legend_and_the_table_of_counts_tell_the_same_shares(finished, figure):
    legend = [text.get_text().split() for text in figure.axes[0].get_legend().get_texts()]
    table = count_table(finished.answer)
    labels, shares = list(table.columns[0].cells), list(table.columns[2].cells)
    assert table.columns[2].header == "share of\nknown posts"
    assert {label: f"{share} %" for label, share, *_ in legend[:5]} == dict(zip(labels, shares, strict=True))


@pytest.mark.parametrize("n_anchors", [1, 2, 4, 7, 8, 12, 64, 1000])
def test_classes_are_few_cover_every_count_and_differ(n_anchors):
    classes = count_classes(n_anchors)
    assert len(classes) <= 8
    assert [n for c in classes for n in range(c.first, c.last + 1)] == list(range(n_anchors + 1))
    colours = [c.rgb for c in classes] + [to_rgb(UNKNOWN_COLOUR)]
    apart = [np.abs(np.subtract(a, b)).max() for i, a in enumerate(colours) for b in colours[:i]]
    assert min(apart) > 0.08


@pytest.mark.parametrize("blind", [
    # Viénot, Brettel and Mollon (1999), linear RGB: protanopia and deuteranopia
    [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
])  # fmt: skip
def test_none_in_sight_stays_apart_for_colour_blind_readers(blind):
    def seen(rgb):
        return np.clip(np.asarray(blind) @ np.asarray(rgb) ** 2.2, 0.0, 1.0) ** (1 / 2.2)

    for colour in count_classes(4)[1:]:
        assert np.abs(seen(colour.rgb) - seen(to_rgb(NONE_COLOUR))).max() > 0.15


def test_a_large_dem_is_drawn_from_every_nth_post():
    sampling = Sampling.of((9000, 6000))
    heights_m = np.tile(np.arange(6000, dtype=np.float32), (9000, 1))
    drawn = pick(heights_m, sampling)
    assert max(drawn.shape) <= 1400
    assert mean_heights(heights_m, sampling.step).shape == drawn.shape


@pytest.mark.parametrize("shape", [(1, 1), (3, 2000), (1400, 7), (1401, 5), (2801, 3), (55, 76)])
def test_every_shape_keeps_its_cells_in_step(shape):
    sampling = Sampling.of(shape)
    heights_m = np.ones(shape, np.float32)
    means = mean_heights(heights_m, sampling.step)
    assert pick(heights_m, sampling).shape == (means.shape[0] * sampling.repeat, means.shape[1] * sampling.repeat)
    np.testing.assert_allclose(means, 1.0)


def test_relief_is_lit_from_the_north_west():
    steps = np.arange(20, dtype=np.float32)
    facing_west = shaded_relief(np.tile(steps, (20, 1)), 1.0, 1.0)
    facing_north = shaded_relief(np.tile(steps[:, None], (1, 20)), 1.0, 1.0)
    facing_east, facing_south = facing_west[:, ::-1], shaded_relief(np.tile(-steps[:, None], (1, 20)), 1.0, 1.0)
    facing_east = shaded_relief(np.tile(-steps, (20, 1)), 1.0, 1.0)
    assert min(facing_west.mean(), facing_north.mean()) > 0.8
    assert max(facing_east.mean(), facing_south.mean()) < 0.5


def test_relief_of_a_plain_and_of_a_hole_is_even():
    heights_m = np.full((5, 5), 7.0, np.float32)
    heights_m[2, 2] = np.nan
    shade = shaded_relief(heights_m, 30.0, 30.0)
    assert np.ptp(shade) == 0.0


@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (2, 2), (900, 40)])
def test_odd_shapes_and_many_anchors_make_a_picture_without_warnings(finished, shape):
    grid = ElevationGrid(np.zeros(shape, np.float32), 10.0, 10.0)
    anchors = tuple(Anchor(f"A{i}", 12.0 * i, -5.0 * i, 50.0) for i in range(60))
    odd = replace(
        finished,
        grid=grid,
        anchors=anchors,
        count=np.full(shape, 30, np.uint8),
        unknown_count=np.zeros(shape, np.uint8),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        seen = pixels(draw_map(odd))
    assert (seen < 0.98).any()


@pytest.mark.parametrize(("crs", "lon", "lat"), [("EPSG:3413", 30.0, 80.0), ("EPSG:32632", 14.4, 64.0), (None, 0, 0)])
def test_the_north_arrow_points_to_true_north(crs, lon, lat):
    origin_m = (0.0, 0.0) if crs is None else pyproj.Proj(crs)(lon, lat)
    grid = ElevationGrid(np.zeros((2, 2)), 1.0, 1.0, *origin_m, crs)
    axes = Figure(figsize=(4.0, 3.0)).add_axes((0.0, 0.0, 1.0, 1.0))
    draw_scale_and_north(axes, 1000.0, 4.0, 3.0, grid_north_deg(grid))
    (arrow,) = (text for text in axes.texts if isinstance(text, Annotation))
    way = (np.array(arrow.xy) - arrow.get_position()) * (4.0, 3.0)
    azimuth_deg = np.degrees(np.arctan2(*way))
    convergence_deg = 0.0 if crs is None else pyproj.Proj(crs).get_factors(lon, lat).meridian_convergence
    assert azimuth_deg == pytest.approx(-convergence_deg, abs=0.01)
