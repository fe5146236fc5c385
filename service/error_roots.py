"""The root of each package's error tree, in one list for the command line, for workers and for HTTP."""

from __future__ import annotations

import sys

__all__ = ["domain_errors"]

ROOTS = {
    "terrain": "TerrainError",
    "gnss": "GnssError",
    "visibility": "VisibilityError",
    "detection": "DetectionError",
    "navigation": "NavigationError",
    "planning": "PlanningError",
}


def domain_errors() -> dict[str, type[Exception]]:
    """The roots by package; one that was never imported has raised nothing."""
    return {name: getattr(sys.modules[name], root) for name, root in ROOTS.items() if name in sys.modules}
