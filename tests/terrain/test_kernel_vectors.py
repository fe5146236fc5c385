"""Reading side by side picks what reading one by one picks, also at the very end of a line."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain.kernel_vectors import LANES, WIDEST_REACH, permutations_active, pick, pick_near


@settings(deadline=None)  # the first example compiles
@given(
    count=st.integers(0, 60),
    step=st.floats(0.0, WIDEST_REACH / LANES),
    first=st.integers(0, 20),
    spare=st.integers(0, 20),
    seed=st.integers(0, 2**32 - 1),
)
def test_places_are_read_alike_one_by_one_and_side_by_side(count, step, first, spare, seed):
    rng = np.random.default_rng(seed)
    room = count + LANES
    places = np.full(room, rng.integers(-1000, 1000), np.int32)  # what lies beyond count is nobody's
    places[:count] = np.floor(rng.random() + step * np.arange(count))
    furthest = first + (int(places[count - 1]) if count else 0)
    source = rng.normal(size=furthest + 1 + spare).astype(np.float32)
    one_by_one, side_by_side = np.zeros((2, room), np.float32), np.zeros((2, room), np.float32)
    pick(source, first, places, count, one_by_one, 1)
    pick_near(source, first, places, count, side_by_side, 1)
    assert one_by_one[1, :count].tolist() == source[first + places[:count]].tolist()
    assert side_by_side[1, :count].tolist() == one_by_one[1, :count].tolist()
    assert not side_by_side[0].any()


def test_unknown_heights_are_picked_as_unknown():
    source = np.full(40, np.nan, np.float32)
    picked = np.zeros((1, 24), np.float32)
    pick_near(source, 0, np.arange(24, dtype=np.int32), 16, picked, 0)
    assert np.isnan(picked[0, :16]).all()


@pytest.mark.parametrize(
    ("features", "name", "active"),
    [("+sse2,+avx2", "", True), ("+sse2,-avx2", "", False), ("", "generic", False)],
)
def test_permutations_serve_where_the_processor_compiled_for_has_them(monkeypatch, features, name, active):
    monkeypatch.setattr(numba.config, "CPU_FEATURES", features)
    monkeypatch.setattr(numba.config, "CPU_NAME", name)
    assert permutations_active() is active
