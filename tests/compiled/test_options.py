"""Kernels are compiled the way the fast sweep and NaN need it."""

import concurrent.futures

import numba
import numpy as np
import pytest

from compiled.options import FASTMATH, cache_folder, inner_loop, kernels_within, noalias_active, scalar_kernel
from terrain.synthetic import fractal
from tests.house.repository import imported_modules, modules
from visibility import Anchor, min_visible_altitude


def test_the_hook_that_keeps_the_fast_sweep_vectorised_is_active():
    # when numba drops the hook this fails on purpose: answers stay right, the sweep takes about twice as long
    assert noalias_active()


def test_arrays_of_an_inner_loop_are_marked_as_not_overlapping(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))  # code from the cache cannot be inspected

    @inner_loop
    def double(values, out):
        for i in range(values.shape[0]):
            out[i] = 2.0 * values[i]

    @scalar_kernel
    def double_plain(values, out):
        for i in range(values.shape[0]):
            out[i] = 2.0 * values[i]

    def marks(compiled):
        compiled(np.ones(4, np.float32), np.zeros(4, np.float32))
        (code,) = compiled.inspect_llvm().values()
        return code.count("noalias")

    assert marks(double) > marks(double_plain)


def test_inner_loops_still_know_nan():
    assert not {"nnan", "ninf", "fast"} & FASTMATH

    @inner_loop
    def count_nan(values):
        count = 0
        for i in range(values.shape[0]):
            if np.isnan(values[i]):
                count += 1
        return count

    assert count_nan(np.array([1.0, np.nan, np.inf, np.nan])) == 2


def test_kernels_are_kept_under_the_digest_of_all_kernel_sources_that_can_be_in_them(tmp_path):
    folder = cache_folder(str(tmp_path), "visibility.sight.kernels")
    assert folder.startswith(str(tmp_path))
    assert folder == cache_folder(str(tmp_path), "visibility.sight.kernels")
    assert folder != cache_folder(str(tmp_path), "detection.kernels")

    @scalar_kernel
    def one(value):
        return value + 1

    assert "kernels-" in str(one._cache.cache_path)


@pytest.mark.parametrize("folder", kernels_within(""))
def test_a_folder_of_kernels_counts_every_folder_that_its_modules_import(folder):
    for source in modules(folder.replace(".", "/")):
        names = imported_modules(source)
        folders = {
            ".".join(name.split(".")[: name.split(".").index("kernels") + 1]) for name in names if "kernels" in name
        }
        assert folders <= set(kernels_within(folder)), source.name
        for other in folders:
            assert set(kernels_within(other)) <= set(kernels_within(folder)), source.name


@pytest.mark.timeout(120)
def test_threads_may_run_parallel_kernels_at_once():
    grid = fractal(96, seed=2)
    anchors = [Anchor(f"A{n}", 30.0 * n, -40.0 * n, 2000.0) for n in range(8)]
    alone = [min_visible_altitude(grid, [anchor]).altitude_m for anchor in anchors]
    with concurrent.futures.ThreadPoolExecutor(8) as threads:
        together = list(threads.map(lambda anchor: min_visible_altitude(grid, [anchor]).altitude_m, anchors * 4))
    for number, altitude_m in enumerate(together):
        np.testing.assert_array_equal(altitude_m, alone[number % 8])


def test_other_threads_run_while_a_kernel_does():
    @scalar_kernel
    def count(rounds):
        total = 0.0
        for i in range(rounds):
            total += np.sqrt(float(i))
        return total

    count(1)
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        long = pool.submit(count, 300_000_000)
        turns = 0
        while not long.done():
            turns += 1
    assert turns > 1000
