"""Colours of the visible count: few discrete classes that colour-blind readers can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.colors import to_hex, to_rgb

__all__ = ["NO_GROUND_COLOUR", "UNKNOWN_COLOUR", "CountClass", "count_classes", "lookup_table"]

MOST_CLASSES = 8
# None in sight is the news a planner looks for: a warm colour that no class of the blue-green ramp comes near.
NONE_COLOUR = "#bd8468"
UNKNOWN_COLOUR = "#b9b9b9"
NO_GROUND_COLOUR = "#e4e4e4"
RAMP, RAMP_FROM, RAMP_TO = "YlGnBu", 0.12, 0.86


@dataclass(frozen=True, slots=True)
class CountClass:
    """Posts that see ``first``..``last`` anchors, and their colour."""

    first: int
    last: int
    rgb: tuple[float, float, float]

    @property
    def colour(self) -> str:
        """The same as #rrggbb."""
        return to_hex(self.rgb)

    @property
    def label(self) -> str:
        """How the legend names it."""
        return str(self.first) if self.first == self.last else f"{self.first}–{self.last}"


def count_classes(n_anchors: int, fewest: int = 1) -> tuple[CountClass, ...]:
    """None, then one class per count from the fewest on; with many anchors, classes of about equal width."""
    n_classes = min(n_anchors - fewest + 1, MOST_CLASSES - 1)
    edges = np.linspace(fewest - 1, n_anchors, n_classes + 1).round().astype(int)
    ramp = matplotlib.colormaps[RAMP](np.linspace(RAMP_FROM, RAMP_TO, n_classes) if n_classes > 1 else [0.6])
    ramped = (
        CountClass(int(low) + 1, int(high), (float(r), float(g), float(b)))
        for low, high, (r, g, b, _) in zip(edges[:-1], edges[1:], ramp, strict=True)
    )
    return CountClass(0, 0, to_rgb(NONE_COLOUR)), *ramped


def lookup_table(classes: tuple[CountClass, ...]) -> npt.NDArray[np.float32]:
    """(n_anchors + 1, 3) colour of each count."""
    return np.array([c.rgb for c in classes for _ in range(c.first, c.last + 1)], np.float32)
