"""Compiles every kernel into numba's on-disk cache, so that no request waits for a compiler."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import detection
from navigation import ESTIMATORS
from service.products import Product, WarmUp
from service.products.registry import PRODUCTS
from service.settings import Rehearsal
from terrain import ElevationGrid

__all__ = ["warm_up", "warm_up_on_all_cores"]


def warm_up(
    what: Rehearsal = "everything", products: Mapping[str, Product] = PRODUCTS, *, own_processes: bool = True
) -> None:
    """Call what every product calculates once on a tiny grid with an unknown post; cheap when the cache is warm.

    The types of the arguments are those of real requests, since numba compiles per type. what: "maps" leaves it at
    what a fast visibility map calls. own_processes: also what starts processes that compile for themselves; they fill
    the cache for everybody, and leave nothing loaded here.
    """
    for part in _parts(products):
        if (part.when == "maps" or what == "everything") and (own_processes or not part.own_processes):
            _warm_up_part(part)


def warm_up_on_all_cores(products: Mapping[str, Product]) -> None:
    """The same with a process per core, for set-up, where everything has yet to be compiled."""
    parts = _parts(products)
    with ProcessPoolExecutor(os.cpu_count(), mp_context=multiprocessing.get_context("spawn")) as pool:
        # most others make maps themselves: those that do not go beside, and the rest finds the maps' kernels compiled
        first = [(part, pool.submit(_warm_up_part, part)) for part in parts if part.when != "after"]
        for part, done in first:
            if part.when == "maps":
                done.result()
        rest = [pool.submit(_warm_up_part, part) for part in parts if part.when == "after"]
        rest += [pool.submit(_of_commands), pool.submit(_of_programs)]
        for done in (*(done for _, done in first), *rest):
            done.result()
    warm_up("everything", products)  # what two processes wrote into the cache at once, one may have to write again


def _parts(products: Mapping[str, Product]) -> list[WarmUp]:
    """Those of maps first."""
    parts = [part for product in products.values() for part in product.warm_up]
    return sorted((*parts, WarmUp(_detections, "beside")), key=lambda part: part.when != "maps")


def _warm_up_part(part: WarmUp) -> None:
    heights_m = np.zeros((12, 10), np.float32)
    heights_m[5, 5] = 40.0
    heights_m[2, 7] = np.nan
    part.call(ElevationGrid(heights_m, 30.0, 25.0))


def _of_commands() -> None:
    """What only commands call: no worker of a service need load it."""
    from gnss.receiver import Samples, measure_channel
    from navigation.targets import KINECT, TargetPixels, fit_sphere_in_image

    rng, times_s = np.random.default_rng(0), np.array([0.0, 0.05])
    samples = Samples((rng.normal(size=(105_000, 2)) @ (1.0, 1j)).astype(np.complex64), 2.1e6)
    measure_channel(samples, 1, times_s, np.full(2, 0.07))
    right, down = (values.ravel() / 20.0 - 0.5 for values in np.meshgrid(np.arange(21.0), np.arange(21.0)))
    inside = right**2 + down**2 < 0.16
    deep = np.sqrt(np.maximum(0.01 - 0.04 * (right**2 + down**2), 0.0))
    ball = np.column_stack([0.2 * right, 0.2 * down, 1.1 - deep])
    cols, rows = 580.0 * ball[:, :2].T / ball[:, 2] + [[319.5], [239.5]]
    pixels = TargetPixels(np.rint(cols[inside]), np.rint(rows[inside]), ball[inside, 2])
    fit_sphere_in_image(pixels, KINECT)


def _detections(_grid: ElevationGrid) -> None:
    places = ((0.0, 0.0, 9.0), (90.0, 0.0, 3.0), (90.0, 80.0, 12.0), (0.0, 80.0, 1.0), (40.0, 30.0, 20.0))
    anchors = [detection.RangingAnchor(str(n), *place) for n, place in enumerate(places)]
    for dimension in (2, 3):
        settings = detection.DetectorSettings(dimension=dimension, search_limit=20)
        detector = detection.Detector(anchors, settings)
        filters = [begun(anchors, settings) for begun in ESTIMATORS.values()] if dimension == 3 else []
        for second in range(3):
            ranges_m = [
                np.linalg.norm(np.subtract(place[:dimension], (30.0, 40.0, 2.0)[:dimension])) for place in places
            ]
            ranges_m[2] += 5.0 * second
            measured = (detection.RangeMeasurement(str(n), float(range_m)) for n, range_m in enumerate(ranges_m))
            motion = detection.OdometryIncrement(1.0, (0.0, 0.0), heading_rad=0.0)
            epoch = detection.RangeEpoch(float(second), tuple(measured), motion)
            result = detector.process(epoch)
            for one in filters:
                one.step(epoch, result, detector.motion)
        # every range another time too long: a cause is looked for
        lies = [detection.RangeMeasurement(str(n), 40.0 + 30.0 * n) for n in range(len(places))]
        for second in range(3, 15):
            detector.process(detection.RangeEpoch(float(second), tuple(lies)))
        detector.suspicions()
    # ranges that meet nowhere, and so many that three rule others out: the bounded search too
    many = (*places, (20.0, 70.0, 30.0), (70.0, 20.0, 25.0), (60.0, 60.0, 5.0))
    odd_m = np.linspace(40.0, 300.0, len(many))
    detection.detect_3d(many, odd_m, 0.1, search_limit=60)
    detection.detect_3d(many, odd_m, 0.1, method="seed", search_limit=60)


def _of_programs() -> None:
    """What only programs call that use the packages: the quality monitor, and pseudoranges in streets."""
    from navigation.inertial import TangentFrame
    from navigation.monitor import judge_epochs
    from navigation.pseudoranges import StreetRanges, StreetStart, WheelReadings, follow_street

    rows = np.concatenate([np.eye(3), np.ones((3, 3)) - np.eye(3)])
    judge_epochs(rows[None], np.zeros((1, 6)), 1.0)
    frame, times_s = TangentFrame(0.9), np.repeat((0.0, 1.0), 3)
    sent_m = np.tile([(2e7, 1e7, 1e7), (2e7, -1e7, 1e7), (1e7, 0.0, 2.4e7)], (2, 1))
    heard_m = np.linalg.norm(frame.from_centred_m(sent_m), axis=1)
    number = np.tile(np.arange(3), 2)
    ranges = StreetRanges(times_s, heard_m, sent_m, number, number % 2, np.full(6, 5.0))
    wheels = WheelReadings(np.array([0.0, 1.0]), np.zeros(2), np.zeros(2))
    follow_street(ranges, wheels, StreetStart((0.0, 0.0, 0.0), 0.0), frame)
