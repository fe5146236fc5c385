"""A bridge in this process, its other end, and a link between them that can be cut and garbled."""

from __future__ import annotations

import contextlib
import math
import socket
import threading
import time

import numpy as np

from detection import Detector, DetectorSettings, RangingAnchor
from service.live.bridges.running import Recorder, site_of

PLACES = {
    "1": (0.0, 0.0, 120.0),
    "2": (400.0, 30.0, 60.0),
    "3": (380.0, 420.0, 140.0),
    "4": (-20.0, 390.0, 80.0),
    "5": (240.0, 150.0, 160.0),
    "6": (90.0, 250.0, 40.0),
}
ANCHORS = [RangingAnchor(name, *at_m) for name, at_m in PLACES.items()]
SETTINGS = DetectorSettings(range_sigma_m=0.1, max_speed_m_per_s=5.0, harmful_m=0.5)


def site(middle=None, grid=None, datum=None, estimator=None):
    return site_of(ANCHORS, SETTINGS, middle, None, grid, datum, estimator)


def rover_m(second):
    """A circle of 50 m about the middle, at 1 m/s."""
    return 190.0 + 50.0 * math.cos(second / 50.0), 210.0 + 50.0 * math.sin(second / 50.0), 2.0


def ranges_m(second, hidden=()):
    noise = np.random.default_rng(round(second))
    at_m = rover_m(second)
    return {
        name: math.dist(place, at_m) + noise.normal(0.0, 0.05) + (6.0 if name in hidden else 0.0)
        for name, place in PLACES.items()
    }


@contextlib.contextmanager
def running(bridge):
    """The bridge in a thread, until the block ends; what its detector raises is raised here."""
    stop, failed = threading.Event(), []

    def run():
        try:
            bridge.run(stop)
        except Exception as error:  # noqa: BLE001 (it is asserted on in the test's own thread)
            failed.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield bridge
    finally:
        stop.set()
        thread.join(30.0)
        assert not thread.is_alive()
        assert failed == []


def until(true, seconds=20.0):
    """Wait until something is so."""
    end_s = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end_s, "it did not come to be"
        time.sleep(0.01)


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def unrecorded():
    return Recorder(None)


class Judge:
    """Remembers what the detector judged."""

    def __init__(self):
        self.epochs = []

    def judged(self, asked, watched):
        self.epochs.append((asked, watched.result))


def alone(epochs):
    """What a detector by itself says of the same epochs."""
    detector = Detector(ANCHORS, SETTINGS)
    return [detector.process(epoch) for epoch in epochs]
