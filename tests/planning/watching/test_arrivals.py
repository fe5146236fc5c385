"""What radios and trees make of what is foretold: closed forms on flat ground, and a session that hears by them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from detection import DetectorSettings, PositionFix, RangeEpoch, RangeMeasurement, RangingAnchor
from planning import WatchError
from planning.watching import Drive, GroundErrors, MapDetector, SightForecast, advise, forecast_sight
from terrain import ElevationGrid
from visibility.cover import Canopy
from visibility.signal import Foliage, Radio, with_foliage

SURE = GroundErrors(dem_sigma_m=1e-3, shift_sigma_m=0.0)
POSTS, CELL_M, ANTENNA_M = 81, 10.0, 1.5
ROVER_M, DRONE_M = (700.0, 400.0), (100.0, 400.0, 61.5)
TOP_M, BASE_M, DEPTH_PER_M = 10.0, 4.0, 0.1
HZ, SPREAD_DB = 2.4e9, 6.0


def plain(wooded: bool) -> ElevationGrid:
    """800 m of level ground at 0 m, all of it under trees with crowns from 4 to 10 m, or none."""
    grid = ElevationGrid(np.zeros((POSTS, POSTS), np.float32), CELL_M, CELL_M, 0.0, 800.0)
    if not wooded:
        return grid
    canopy = Canopy(grid, np.full(grid.shape, TOP_M, np.float32), np.full(grid.shape, BASE_M, np.float32))
    return with_foliage(grid, Foliage(canopy, "density", DEPTH_PER_M))


def phi(x: float) -> float:
    return 0.5 * math.erfc(-x / math.sqrt(2.0))


def far_m() -> float:
    return math.dist((*ROVER_M, ANTENNA_M), DRONE_M)


def free_space_db() -> float:
    """Friis, 20 lg(4 π d f / c)."""
    return 20.0 * math.log10(4.0 * math.pi * far_m() * HZ / 299_792_458.0)


def trees_db() -> float:
    """10 lg(e) per unit of optical depth, on the part of the line between 4 and 10 m of its 1.5 to 61.5 m."""
    return 10.0 / math.log(10.0) * DEPTH_PER_M * far_m() * (TOP_M - BASE_M) / (DRONE_M[2] - ANTENNA_M)


def forecast(grid: ElevationGrid, radio: Radio | None) -> SightForecast:
    ends_m = [DRONE_M, (100.0, 700.0, 61.5)]
    found = forecast_sight(grid, ROVER_M, 1e-8 * np.eye(2), ends_m, ANTENNA_M, errors=SURE, radios=[radio, None])
    assert found is not None
    return found


def test_trees_in_the_way_are_a_closed_form() -> None:
    margin_db = -4.0
    radio = Radio(HZ, free_space_db() + trees_db() + margin_db, 0.0, spread_db=SPREAD_DB)
    told = forecast(plain(wooded=True), radio)
    assert told.margin_db[0] == pytest.approx(margin_db, abs=0.01)
    assert told.p_usable[0] == pytest.approx(phi(margin_db / SPREAD_DB), abs=1e-3)
    assert told.p_sight[0] > 0.999
    # it arrived: straight, or round by a way that costs 12 dB more than open air
    round_about = phi((trees_db() + margin_db - 12.0) / SPREAD_DB)
    straight = phi(margin_db / SPREAD_DB)
    assert told.p_direct[0] == pytest.approx(straight / (straight + (1.0 - straight) * round_about), abs=2e-3)
    assert told.p_direct[0] < 0.35


def test_an_anchor_without_a_radio_is_in_sight_or_not() -> None:
    told, none = forecast(plain(wooded=True), Radio(HZ, 60.0, 0.0)), forecast(plain(wooded=True), None)
    assert np.isnan([told.p_usable[1], told.margin_db[1], *none.p_usable, *none.margin_db]).all()
    assert told.p_direct[1] == none.p_direct[1] == none.p_direct[0]


def test_a_range_from_the_edge_of_the_open_came_straight_all_the_same() -> None:
    told = forecast(plain(wooded=False), Radio(HZ, free_space_db() - 10.0, 0.0, spread_db=SPREAD_DB))
    assert told.p_usable[0] == pytest.approx(phi(-10.0 / SPREAD_DB), abs=1e-3)
    assert told.p_direct[0] > 0.95


def test_without_a_spread_it_is_a_step() -> None:
    for margin_db, usable in ((0.5, 1.0), (-0.5, 0.0)):
        radio = Radio(HZ, free_space_db() + trees_db() + margin_db, 0.0, spread_db=0.0)
        told = forecast(plain(wooded=True), radio)
        assert (told.p_usable[0], told.p_direct[0]) == (usable, usable)


def anchors() -> list[RangingAnchor]:
    places = [(100, 400, 60), (120, 250, 62), (760, 100, 55), (660, 760, 90), (780, 600, 70), (300, 760, 120)]
    return [RangingAnchor(f"A{n + 1}", *map(float, place)) for n, place in enumerate(places)]


def western(east_m: float) -> ElevationGrid:
    """Trees west of the rover only: A1, A2 and A6 are behind them."""
    grid = ElevationGrid(np.zeros((POSTS, POSTS), np.float32), CELL_M, CELL_M, 0.0, 800.0)
    top_m = np.where(np.arange(POSTS) * CELL_M < east_m, 30.0, 0.0).astype(np.float32)
    return with_foliage(grid, Foliage(Canopy(grid, np.tile(top_m, (POSTS, 1)), 0.0 * grid.heights_m), "density", 0.2))


def epoch(second: int, too_long_m: float) -> RangeEpoch:
    ranges = [
        RangeMeasurement(a.id, math.dist((a.east_m, a.north_m, a.altitude_m), (*ROVER_M, ANTENNA_M)) + more)
        for a, more in zip(anchors(), (too_long_m, too_long_m, 0.0, 0.0, 0.0, 0.0), strict=True)
    ]
    return RangeEpoch(float(second), tuple(ranges))


def test_a_session_with_radios_knows_who_is_heard_through_the_trees() -> None:
    radios = {a.id: Radio(HZ, 110.0, 0.0) for a in anchors()}
    grid, settings = western(650.0), DetectorSettings(harmful_m=0.5, max_speed_m_per_s=2.0)
    hearing = MapDetector(grid, anchors(), settings, ANTENNA_M, SURE, radios=radios)
    seeing = MapDetector(grid, anchors(), settings, ANTENNA_M, SURE)
    heard, seen = hearing.process(epoch(0, 3.0)), seeing.process(epoch(0, 3.0))
    assert heard.result.excluded == ("A1", "A2")
    assert np.linalg.norm(heard.result.position.position_m[:2] - ROVER_M) < 0.5  # type: ignore[union-attr] # it is there
    assert seen.result.excluded == ()
    assert heard.p_usable["A1"] < 0.01 < 0.99 < heard.p_usable["A4"]
    assert heard.p_direct["A1"] < 0.1
    assert seen.p_usable == {}
    assert (hearing.warnings, len(seeing.warnings)) == ((), 1)
    assert "canopy" in seeing.warnings[0]


def test_anchors_that_are_not_heard_ahead_do_not_count() -> None:
    radios = {a.id: Radio(HZ, 110.0, 0.0) for a in anchors()}
    drive = Drive(np.array([(700.0, 400.0), (790.0, 400.0)]), min_anchors=4)
    place = PositionFix(np.array([*ROVER_M, ANTENNA_M]), 0.01 * np.eye(3), checked=True)
    stretches = [
        advise(western(650.0), drive, place, anchors(), errors=SURE, radios=heard).stretches for heard in (radios, {})
    ]
    assert stretches[1] == ()
    assert stretches[0][0].hidden == ("A1", "A2", "A6")


def test_what_a_model_cannot_tell_is_told_and_left_to_sight() -> None:
    grid = with_foliage(plain(wooded=False), replace(_foliage(), model="weissberger", depth_per_m=None))
    low = Radio(100e6, 90.0, 0.0)
    detector = MapDetector(grid, anchors(), DetectorSettings(harmful_m=0.5), radios={"A1": low})
    assert any("Weissberger" in warning for warning in detector.warnings)
    told = detector.process(epoch(0, 0.0))
    assert "A1" not in told.p_usable
    assert told.p_direct["A1"] > 0.8


def _foliage() -> Foliage:
    grid = plain(wooded=False)
    return Foliage(Canopy(grid, np.full(grid.shape, TOP_M, np.float32), 0.0 * grid.heights_m), "density", DEPTH_PER_M)


def test_a_radio_of_nobody_is_refused() -> None:
    with pytest.raises(WatchError, match="no anchor 'A9'"):
        MapDetector(plain(wooded=False), anchors(), radios={"A9": Radio(HZ, 0.0, 0.0)})
