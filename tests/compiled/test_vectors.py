"""Reading side by side picks what reading one by one picks, and a turned block is the block turned."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compiled.options import inner_loop
from compiled.vectors import (
    AVX2,
    AVX512,
    BLOCK,
    LANES,
    compiled_for,
    pick,
    pick_pair,
    pick_pair_wide,
    prefetch,
    turn_block,
)


@inner_loop
def _picked(source, first, places, out):
    for i in range(0, out.shape[1], LANES):
        pick(source, first, places, i, out, 1)


@inner_loop
def _pairs_picked(source, first, places, out):
    for i in range(0, out.shape[1], LANES):
        pick_pair(source, first, places, i, out, 1)


@inner_loop
def _wide_pairs_picked(source, first, places, out):
    for i in range(0, out.shape[1], LANES):
        pick_pair_wide(source, first, places, i, out, 1)


@inner_loop
def _turned(source, row, col, out, out_row, out_col):
    turn_block(source, row, col, out, out_row, out_col)


@inner_loop
def _asked_for(grid):
    for row in range(grid.shape[0]):
        prefetch(grid, row, 0)


@pytest.mark.parametrize(
    ("kernel", "pairs", "reach"),
    [
        (_picked, False, LANES - 1),
        (_pairs_picked, True, 2 * LANES - 2),
        (_wide_pairs_picked, True, 4 * LANES - 2),
    ],
)
@settings(deadline=None)  # the first example compiles
@given(
    vectors=st.integers(1, 4),
    share_of_reach=st.floats(0.0, 1.0),
    first=st.integers(0, 20),
    start=st.integers(0, 1000),
    seed=st.integers(0, 2**32 - 1),
)
def test_places_are_read_alike_one_by_one_and_side_by_side(
    kernel, pairs, reach, vectors, share_of_reach, first, start, seed
):
    rng = np.random.default_rng(seed)
    count = vectors * LANES
    # rising places, of which no vector spans more than the reach
    within = np.sort(rng.integers(0, int(share_of_reach * reach) + 1, (vectors, LANES)), axis=1)
    within[:, 0] = 0
    places = (start + within + np.cumsum(within[:, -1:], axis=0)).astype(np.int32).ravel()
    source = rng.normal(size=first + int(places[-1]) + 4 * LANES + 1).astype(np.float32)
    source[rng.random(source.shape) < 0.05] = np.nan
    out = np.zeros((4, count), np.float32)
    kernel(source, first, places, out)
    np.testing.assert_array_equal(out[1], source[first + places])
    np.testing.assert_array_equal(out[2], source[first + places + 1] if pairs else np.zeros(count))
    assert not out[0].any()
    assert not out[3].any()


def test_a_block_is_turned_and_nothing_beside_it_written():
    rng = np.random.default_rng(1)
    source = rng.normal(size=(2 * BLOCK, 3 * BLOCK)).astype(np.float32)
    out = np.zeros((2 * BLOCK, 2 * BLOCK), np.float32)
    _turned(source, 3, 5, out, 2, 7)
    wanted = np.zeros_like(out)
    wanted[2 : 2 + BLOCK, 7 : 7 + BLOCK] = source[3 : 3 + BLOCK, 5 : 5 + BLOCK].T
    assert out.tolist() == wanted.tolist()


def test_asking_ahead_changes_nothing():
    grid = np.arange(40, dtype=np.float32).reshape(8, 5)
    _asked_for(grid)
    assert grid.ravel().tolist() == list(range(40))


@pytest.mark.parametrize(
    ("features", "name", "active"),
    [
        ("+sse2,+avx2", "", [True, False]),
        ("+avx2,+avx512f", "", [True, True]),
        ("+sse2,-avx2", "", [False, False]),
        ("", "generic", [False, False]),
    ],
)
def test_vectors_are_as_wide_as_the_processor_compiled_for_has_them(monkeypatch, features, name, active):
    monkeypatch.setattr(numba.config, "CPU_FEATURES", features)
    monkeypatch.setattr(numba.config, "CPU_NAME", name)
    assert [compiled_for(AVX2), compiled_for(AVX512)] == active
