"""After the warm-up no map, and no layer of one, waits for a compiler; the demo's needs no more than that of maps."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dem_samples
import terrain
import visibility
from service.cli.demo import DRONES, RECEIVER_ABOVE_GROUND_M
from service.jobs.kept_files import load, save
from service.products import Product, Work
from service.products.dop import DOP_MAP
from service.products.morphing import MORPHING_MAP
from service.products.registry import PRODUCTS
from service.products.visibility import VISIBILITY_MAP
from service.settings import Rehearsal
from service.warm_up import warm_up
from terrain import ElevationGrid

PLACES = ((0.2, 0.2), (0.5, 0.3), (0.8, 0.25), (0.3, 0.7))


def compiled() -> dict[str, int]:
    """How many versions of each kernel this process has."""
    versions = {}
    for package in (terrain, visibility):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if ".kernels." not in found.name:
                continue
            for name, value in vars(importlib.import_module(found.name)).items():
                if hasattr(value, "signatures"):
                    versions[f"{found.name}.{name}"] = len(value.signatures)
    return versions


def requests(grid: ElevationGrid) -> list[tuple[Product, dict[str, Any]]]:
    west_m, south_m, east_m, north_m = grid.bounds_m
    places = [
        {"east_m": west_m + x * (east_m - west_m), "north_m": south_m + y * (north_m - south_m)} for x, y in PLACES
    ]
    anchors = [{"id": f"D{n}", **place, "above_ground_m": 300.0} for n, place in enumerate(places)]
    points = [{**place, "altitude_m": 3000.0, "time_s": 60.0 * n} for n, place in enumerate(places[:2])]
    air = {
        "volume": {"ceiling_above_ground_m": 90.0},
        "cuts": [{"line": places[:2]}, {"altitude_m": 900.0}, {"above_ground_m": 9.0}],
        "path": [{**places[0], "above_ground_m": 2.0}],
    }
    over_time = {"tracks": [{"id": "T", "points": points}], "frames": {"to_s": 60.0, "step_s": 30.0}}
    asked: list[tuple[Product, dict[str, Any]]] = [
        (DOP_MAP, {"on_surface": True}),
        (DOP_MAP, {"kind": "pseudorange", **air}),
        (DOP_MAP, {"one_dop_per_set": True, **air}),
        (MORPHING_MAP, {"ceiling_above_ground_m": 500.0, **over_time}),
        (MORPHING_MAP, {"ceiling_above_ground_m": 500.0, "kind": "pseudorange", "measure": "tdop"}),
    ]
    return [(product, {"anchors": anchors, **more}) for product, more in asked]


def make_everything(folder: Path) -> None:
    for sample in ("valley", "jacksboro"):
        grid = dem_samples.load_sample(sample).window(0, 59, 0, 79)
        for number, (product, asked) in enumerate(requests(grid)):
            kept = folder / f"{sample}-{number}"
            parameters = product.parameters.model_validate(asked)
            save(product, product.calculate(grid, parameters, Work()), kept)
            _, finished = load(PRODUCTS, kept)
            for layer in product.layers:
                # pictures and text files call no kernels that rasters do not
                if layer.is_of(asked) and layer.name.endswith((".tif", ".npz", ".nc", "cut-1.png", "cut-2.png")):
                    layer.save(finished, kept / layer.name)


def make_the_map_of_the_demo(folder: Path) -> None:
    drones = [{"id": name, "lon_deg": lon, "lat_deg": lat, "above_ground_m": 150.0} for name, lon, lat in DRONES]
    asked = {"anchors": drones, "receiver_above_ground_m": RECEIVER_ABOVE_GROUND_M}
    grid = dem_samples.load_sample("jacksboro")
    parameters = VISIBILITY_MAP.parameters.model_validate(asked)
    save(VISIBILITY_MAP, VISIBILITY_MAP.calculate(grid, parameters, Work()), folder)
    _, finished = load(PRODUCTS, folder)
    for layer in VISIBILITY_MAP.layers:
        if layer.is_of(asked):
            layer.save(finished, folder / layer.name)


def main(what: Rehearsal, make: Callable[[Path], None], folder: Path) -> None:
    warm_up(what)
    before = compiled()
    make(folder)
    print(sorted(name for name, versions in compiled().items() if versions != before[name]))


@pytest.mark.parametrize(("what", "make"), [("everything", make_everything), ("maps", make_the_map_of_the_demo)])
def test_no_kernel_is_compiled_after_the_warm_up(what: Rehearsal, make: Callable[[Path], None], tmp_path: Path) -> None:
    # in a process of its own: this one may have compiled anything
    program = (
        f"from pathlib import Path; from {__name__} import {make.__name__}, main; "
        f"main({what!r}, {make.__name__}, Path({str(tmp_path)!r}))"
    )
    root = Path(__file__).parents[2]
    run = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.splitlines()[-1] == "[]"


def test_the_kernels_of_maps_are_compiled_for_one_type_of_heights(tmp_path: Path) -> None:
    # grids' heights, ground with unknown posts, ground under satellites: read-only and writable arrays are two types
    program = (
        "from service.warm_up import warm_up; warm_up(); "
        "from visibility.sight.kernels import exact, sweep, turning; "
        "print([len(kernel.signatures) for kernel in (exact.sweep, sweep.sweep, turning.turn)])"
    )
    root = Path(__file__).parents[2]
    run = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[1, 1, 1]"


def test_what_only_commands_call_is_compiled_as_they_call_it(tmp_path):
    from gnss.receiver import measure_channel, read_samples
    from gnss.receiver.kernels.correlate import correlate
    from navigation.targets import KINECT, TargetPixels, fit_sphere_in_image
    from navigation.targets.kernels.spheres import sphere_likelihood
    from service.warm_up import _of_commands
    from tests.reference import depth_images

    _of_commands()
    before = len(correlate.signatures), len(sphere_likelihood.signatures)
    assert min(before) >= 1
    noise = np.random.default_rng(1).normal(scale=20.0, size=210_000)
    noise.astype(np.int8).tofile(tmp_path / "noise.bin")
    measure_channel(read_samples(tmp_path / "noise.bin", 2.1e6, "int8"), 7, [0.0, 0.05], [0.07, 0.07])
    sensor = (580.0, 319.5, 239.5, 3.3309, 0.00307)
    fit_sphere_in_image(TargetPixels(*depth_images.image(depth_images.ball((0.0, 0.0, 1.5), 0.15), sensor)), KINECT)
    assert (len(correlate.signatures), len(sphere_likelihood.signatures)) == before
