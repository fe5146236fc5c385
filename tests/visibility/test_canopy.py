"""Ways through canopy against counting points, and what they cost a signal against printed formulas and Davos."""

import numpy as np
import pytest
import shapely

from benchmarks.visibility.woods import DAVOS, davos_pairs
from terrain import ElevationGrid
from tests.reference.canopy import way_through
from tests.visibility.meshes import level
from visibility import FLAT, CoverError
from visibility.cover import (
    Canopy,
    Footprint,
    canopy_between,
    canopy_depths,
    canopy_paths,
    density_loss,
    early_itu_loss,
    fit_density,
    p833_slant_loss,
    p833_woodland_loss,
    resampled_canopy,
    standing_footprints,
    weissberger_loss,
    with_standing,
)
from visibility.signal import RADIOS, Foliage, signals

ONE_PER_CENT = 0.01


@pytest.mark.parametrize("seed", range(4))
def test_ways_through_rough_canopy_over_rough_ground_are_those_of_counted_points(seed):
    rng = np.random.default_rng(seed)
    heights_m = rng.uniform(0.0, 12.0, (9, 11)).astype(np.float32)
    top_m = np.where(rng.random((9, 11)) < 0.3, 0.0, rng.uniform(5.0, 25.0, (9, 11))).astype(np.float32)
    base_m = (top_m * rng.uniform(0.0, 0.6, (9, 11))).astype(np.float32)
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    canopy = Canopy(grid, top_m, base_m)
    for _ in range(6):
        start, end = (np.array([*rng.uniform((0.2, 0.2), (7.8, 9.8)), rng.uniform(0.0, 40.0)]) for _ in range(2))
        ends_m = [(point[1] * 10.0, -point[0] * 10.0, point[2]) for point in (start, end)]
        found_m = float(canopy_paths(canopy, [ends_m[0]], [ends_m[1]], FLAT)[0])
        wanted_m = way_through(heights_m, top_m, base_m, 10.0, start, end)
        assert found_m == pytest.approx(wanted_m, rel=ONE_PER_CENT, abs=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_depths_by_a_raster_of_densities_are_those_of_counted_points(seed):
    rng = np.random.default_rng(seed + 10)
    heights_m = rng.uniform(0.0, 12.0, (9, 11)).astype(np.float32)
    top_m = np.where(rng.random((9, 11)) < 0.2, 0.0, rng.uniform(5.0, 25.0, (9, 11))).astype(np.float32)
    base_m = (top_m * rng.uniform(0.0, 0.6, (9, 11))).astype(np.float32)
    density = rng.uniform(0.0, 0.2, (9, 11)).astype(np.float32)
    density[top_m == 0.0] = np.nan  # nobody measured where no trees are: none there
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    canopy = Canopy(grid, top_m, base_m, density_per_m=density)
    for _ in range(6):
        start, end = (np.array([*rng.uniform((0.2, 0.2), (7.8, 9.8)), rng.uniform(0.0, 40.0)]) for _ in range(2))
        ends_m = [(point[1] * 10.0, -point[0] * 10.0, point[2]) for point in (start, end)]
        found = float(canopy_depths(canopy, [ends_m[0]], [ends_m[1]], FLAT)[0])
        wanted = way_through(heights_m, top_m, base_m, 10.0, start, end, densities=np.nan_to_num(density))
        assert found == pytest.approx(wanted, rel=ONE_PER_CENT, abs=0.002)


def test_a_density_at_each_post_is_the_loss_of_a_signal_and_what_is_unknown_of_it_stays_so():
    grid = level(100.0, 101, 101)
    top_m, base_m = np.full(grid.shape, 20.0, np.float32), np.full(grid.shape, 5.0, np.float32)
    density = np.where(np.arange(101)[None, :] < 50, 0.01, 0.03) * np.ones((101, 1))
    west, east = ((100.0, -250.0, 110.0), (200.0, -250.0, 110.0)), ((300.0, -250.0, 110.0), (400.0, -250.0, 110.0))
    starts_m, ends_m = (np.array(points) for points in zip(west, east, strict=True))
    foliage = Foliage(Canopy(grid, top_m, base_m, density_per_m=density), "density", season=0.5)
    heard = signals(grid, starts_m, ends_m, RADIOS["868MHz"], foliage=foliage, curvature=FLAT)
    np.testing.assert_allclose(heard.canopy_m, 100.0)
    np.testing.assert_allclose(heard.canopy_db, 0.5 * 10.0 * np.log10(np.e) * np.array([1.0, 3.0]), rtol=1e-5)
    for unknown, wanted in ((density, [False, True]), (base_m, [False, True])):
        partly = np.array(unknown, np.float32)
        partly[:, 70] = np.nan
        layers = {"base_m": base_m, "density_per_m": density, ("density_per_m", "base_m")[unknown is base_m]: partly}
        found = canopy_depths(Canopy(grid, top_m, **layers), starts_m, ends_m, FLAT)
        assert np.isnan(found).tolist() == wanted
    with pytest.raises(CoverError, match="has no density of its own"):
        canopy_depths(Canopy(grid, top_m, base_m), starts_m, ends_m)
    with pytest.raises(CoverError, match="numbers from 0 to 1,000,000; 101 posts are not"):
        Canopy(grid, top_m, base_m, density_per_m=np.where(np.arange(101) == 3, -0.1, 0.1))
    with pytest.raises(CoverError, match='belongs to the model "density", and to no other'):
        Foliage(foliage.canopy, "density", 0.1)
    with pytest.raises(CoverError, match='belongs to the model "density", and to no other'):
        Foliage(foliage.canopy)


def test_a_level_forest_is_as_long_as_its_height_over_the_sine():
    grid = level(100.0, 101, 101)
    canopy = Canopy(grid, np.full(grid.shape, 20.0, np.float32), np.full(grid.shape, 5.0, np.float32))
    for elevation_deg in (20.0, 45.0, 80.0):
        up = np.radians(elevation_deg)
        # from the ground up to 30 m over it
        end = (150.0 + 30.0 / np.tan(up), -250.0, 130.0)
        way_m = canopy_paths(canopy, [(150.0, -250.0, 100.0)], [end], FLAT)
        np.testing.assert_allclose(way_m, 15.0 / np.sin(up), rtol=1e-9)


def test_a_surface_less_the_ground_is_canopy_and_roofs_are_none():
    grid = level(100.0)
    built = with_standing(grid, [standing_footprints(grid, [Footprint(shapely.box(140, -110, 160, -90), 10.0)])])
    surface_m = grid.heights_m + np.float32(12.0)
    surface_m[0, 0] -= 14.0
    canopy = canopy_between(built, ElevationGrid(surface_m, 5.0, 5.0))
    assert canopy.top_m[20, 10] == 12.0
    assert canopy.top_m[20, 30] == 0.0
    assert canopy.notes == (
        "At 1 posts the surface is below the ground, by up to 2.00 m: no canopy there.",
        "25 posts under roofs are no canopy.",
    )


def test_canopy_of_other_posts_is_resampled_and_told_and_of_another_frame_refused():
    grid = level()
    coarse = ElevationGrid(np.full((25, 35), 8.0, np.float32), 10.0, 10.0)
    canopy = resampled_canopy(grid, coarse)
    assert (canopy.top_m == 8.0).all()
    assert canopy.notes == ("The canopy's posts are 10 by 10 m apart; it was resampled to the DEM's.",)
    elsewhere = ElevationGrid(np.full((25, 35), 8.0, np.float32), 10.0, 10.0, 0.0, 0.0, "EPSG:32611")
    with pytest.raises(CoverError, match="read both in one CRS"):
        resampled_canopy(grid, elsewhere)
    with pytest.raises(CoverError, match="heights >= 0 m; 1 posts are below"):
        Canopy(grid, np.where(np.indices(grid.shape).sum(axis=0) == 0, -1.0, 2.0), 0.0)
    with pytest.raises(CoverError, match="crown base is above"):
        Canopy(grid, 5.0, 6.0)


# -- models: where a base of the formula is a power of ten or two, the value can be had without a calculator's help

GHZ = 1e9


@pytest.mark.parametrize(
    ("loss", "wanted_db"),
    [
        (weissberger_loss([10.0], 1.0 * GHZ), 4.5),  # 0.45·1·10
        (weissberger_loss([100.0], 1.0 * GHZ), 1.33 * 14.9968),  # 1.33·10^1.176
        (weissberger_loss([100.0], 10.0 * GHZ), 1.33 * 28.8403),  # 1.33·10^(0.284+1.176)
        (early_itu_loss([1.0], 1.0 * GHZ), 0.2 * 7.94328),  # 0.2·10^0.9
        (early_itu_loss([100.0], 1.0 * GHZ), 0.2 * 125.8925),  # 0.2·10^(0.9+1.2)
        (early_itu_loss([10.0], 10.0 * GHZ), 0.2 * 63.0957),  # 0.2·10^(1.2+0.6)
        (p833_slant_loss([16.0], 1.0 * GHZ, np.radians([1.0])), 0.25 * 14.7911 * 2.0),  # 0.25·10^1.17·16^0.25
        (p833_slant_loss([16.0], 1.0 * GHZ, np.radians([32.0])), 0.25 * 14.7911 * 2.0 * 1.189207),  # 32^0.05 = 2^0.25
        (p833_slant_loss([1.0], 10.0 * GHZ, np.radians([1.0])), 0.25 * 36.3078),  # 0.25·10^1.56
        (p833_woodland_loss([1e6], 0.949 * GHZ), 26.5),  # the most there is
        (p833_woodland_loss([26.5 / 0.17], 0.949 * GHZ), 26.5 * 0.6321206),  # 1 - 1/e
        (p833_woodland_loss([0.001], 2.1175 * GHZ), 0.00034),  # 0.34 dB/m at first
    ],
)
def test_models_give_the_values_of_their_printed_formulas(loss, wanted_db):
    assert not any("nothing" in note for note in loss.notes)
    assert loss.loss_db[0] == pytest.approx(wanted_db, rel=2e-5)


@pytest.mark.parametrize(
    ("loss", "sentence"),
    [
        (
            weissberger_loss([10.0], 0.1 * GHZ),
            "Weissberger's model is for 230 to 95000 MHz; nothing is told at 100 MHz.",
        ),
        (
            weissberger_loss([401.0], 1.0 * GHZ),
            "Weissberger's model ends at 400 m of trees; 1 longer ways have no loss",
        ),
        (p833_slant_loss([10.0], 0.01 * GHZ, [0.5]), "ITU-R P.833 for slant paths is for 30 to 100000 MHz"),
        (p833_woodland_loss([10.0], 3.5 * GHZ), "ITU-R P.833 for woodland is for 105.9 to 2117.5 MHz"),
    ],
)
def test_beyond_its_range_a_model_tells_nothing_and_says_so(loss, sentence):
    assert np.isnan(loss.loss_db).all()
    assert loss.notes[0].startswith(sentence)


def test_the_early_itu_model_says_that_its_source_tells_no_range():
    assert early_itu_loss([10.0], 0.1 * GHZ).notes == (
        "The early ITU model's source tells no range of frequencies or depths.",
    )


def test_ways_that_do_not_rise_are_told_where_the_model_is_of_slant_paths():
    level_way = p833_slant_loss([10.0, 10.0], 1.0 * GHZ, [0.0, 0.5])
    assert np.isnan(level_way.loss_db).tolist() == [True, False]
    assert level_way.notes == ("ITU-R P.833 for slant paths tells nothing of 1 ways that do not rise.",)


def test_a_density_is_found_again_in_the_losses_that_it_makes():
    way_m = np.linspace(1.0, 80.0, 400)
    loss_db = density_loss(way_m, 0.05) + np.random.default_rng(5).normal(0.0, 2.0, 400)
    fit = fit_density(loss_db, way_m)
    assert abs(fit.depth_per_m - 0.05) < 4.0 * fit.sigma_per_m
    assert fit.rms_db == pytest.approx(2.0, rel=0.1)
    assert density_loss([10.0], 0.1, season=0.5)[0] == pytest.approx(10.0 * np.log10(np.e) * 0.5)
    with pytest.raises(CoverError, match="at least two losses"):
        fit_density([3.0], [1.0])
    for loss_db, ways_m in (([1e300, 3.0], [1.0, 2.0]), ([1.0, 3.0], [1e300, 2.0])):
        with pytest.raises(CoverError, match="Losses must lie within ±1,000 dB, and ways through trees within"):
            fit_density(loss_db, ways_m)
    for depth_per_m, season in ((1e300, 1.0), (0.1, 1e300), (np.nan, 1.0), (-0.1, 1.0)):
        with pytest.raises(CoverError, match="must be a number from 0 to 1,000,000, not"):
            density_loss([10.0], depth_per_m, season)


def rms(values):
    return float(np.sqrt((values**2).mean()))


@pytest.mark.skipif(not DAVOS.is_dir(), reason="the Davos pairs lie in ../shared/data, which is not here")
@pytest.mark.parametrize("half", ["the first", "the second"])
def test_a_density_fitted_to_half_of_the_davos_pairs_foretells_the_other_half(half):
    second, loss_db, up_rad = davos_pairs()
    fitted = (second < np.median(second)) == (half == "the first")
    fit = fit_density(loss_db[fitted], 1.0 / np.sin(up_rad[fitted]))
    left_db = loss_db[~fitted] - density_loss(1.0 / np.sin(up_rad[~fitted]), fit.depth_per_m)
    assert np.count_nonzero(~fitted) > 2500
    assert rms(left_db) <= 5.5


@pytest.mark.skipif(not DAVOS.is_dir(), reason="the Davos pairs lie in ../shared/data, which is not here")
def test_published_models_are_further_from_davos_than_a_fitted_density():
    _, loss_db, up_rad = davos_pairs()
    way_m = 25.0 / np.sin(up_rad)  # trees of 25 m
    of_l1 = 1.57542 * GHZ
    found_db = [
        rms(loss_db - model.loss_db)
        for model in (
            p833_slant_loss(way_m, of_l1, up_rad),
            weissberger_loss(way_m, of_l1),
            early_itu_loss(way_m, of_l1),
        )
    ]
    # as they were worked out apart from this code when the data were chosen
    assert found_db == pytest.approx([8.5, 9.0, 12.4], abs=0.06)


def test_canopy_that_rises_to_a_bare_post_above_all_crowns_is_met():
    # between trees on low ground and a bare ridge the canopy stands higher than any crown over a post
    heights_m, top_m = np.zeros((30, 30), np.float32), np.full((30, 30), 10.0, np.float32)
    heights_m[:, 10], top_m[:, 10] = 100.0, 0.0
    grid = ElevationGrid(heights_m, 5.0, 5.0)
    canopy = Canopy(grid, top_m, np.zeros_like(top_m))
    # half way up the side of the ridge: ground at 50 m, crowns at 55 m
    start, end = (9.5 * 5.0, -5.0, 52.0), (9.5 * 5.0, -140.0, 52.0)
    assert canopy_paths(canopy, [start], [end], FLAT)[0] == pytest.approx(135.0)
