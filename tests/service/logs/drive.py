"""One drive past six anchors, for logs of every kind: what was measured when, and how the rover moved."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

ANCHORS = {
    1: (0.0, 0.0, 120.0),
    2: (400.0, 30.0, 60.0),
    3: (380.0, 420.0, 140.0),
    4: (-20.0, 390.0, 80.0),
    5: (240.0, 150.0, 160.0),
    6: (90.0, 250.0, 40.0),
}
SECONDS = 30
# a Wednesday whose day can be no month
BEGIN_S = 1_715_767_200.0  # 2024-05-15T10:00:00Z


def place_m(second: int) -> tuple[float, float, float]:
    """East, north, up of the rover."""
    return 60.0 + 3.0 * second, 80.0 + 2.0 * second, 2.0


def _ranges() -> list[tuple[int, int, float]]:
    noise = np.random.default_rng(3)
    return [
        (second, anchor, round(math.dist(at, place_m(second)) + noise.normal(0.0, 0.05), 2))
        for second in range(SECONDS)
        for anchor, at in ANCHORS.items()
    ]


RANGES = _ranges()


def table(head: str, line: str, between: str = "\n", **more: object) -> str:
    """A line for each range; in it {t} is the second, {a} the anchor, {r} the range."""
    return between.join([head, *(line.format(t=t, a=a, r=r, **more) for t, a, r in RANGES), ""])


def moments() -> list[tuple[int, dict[int, float]]]:
    """The ranges of each second."""
    return [(second, {a: r for t, a, r in RANGES if t == second}) for second in range(SECONDS)]


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
