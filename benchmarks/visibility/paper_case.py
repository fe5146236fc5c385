"""The case of De Vivo et al., IV-A, on ground and satellites at hand: 10 km × 13 km of mountains, PDOP below 2.5.

Big Tujunga canyon in the San Gabriel Mountains stands in for Mount Mitchell, a YUMA almanac of December 2007 for the
paper's. At both instants 12 satellites are in the cone of 85°; at the second they stand badly.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np

import gnss
from terrain import ElevationGrid, height_at, read_dem
from visibility import (
    DistantAnchor,
    FlightLimit,
    MinimumVisibleAltitude,
    altitude_layers,
    control_volume,
    dop,
    min_visible_altitude,
    morphing_map,
    satellites,
)
from visibility.air import (
    ControlVolume,
    HorizontalSection,
    MorphingMap,
    VerticalSection,
    horizontal_section,
    vertical_section,
)

__all__ = [
    "ALMANAC_FILE",
    "BAD",
    "CEILING_M",
    "COLS",
    "DEM_FILE",
    "GOOD",
    "LAYER_M",
    "LIMIT",
    "ROWS",
    "SECTION",
    "Scene",
    "cut_out",
    "mountain_almanac",
    "open_sky_pdop",
    "paper_window",
    "read_mountains",
    "scene",
    "sections",
]

DATA = Path(__file__).parents[2] / "../shared/data"
DEM_FILE = DATA / "dem" / "bigtujunga.tif"
ALMANAC_FILE = DATA / "almanac" / "mmazat_yuma431.txt"
ALMANAC_DATE = date(2007, 12, 1)  # which of the weeks that are called 431

# 334 × 434 posts of 30 m: the canyon in the middle of the map, from its floor at 457 m to 1992 m
FIRST_ROW, FIRST_COL, ROWS, COLS = 90, 180, 434, 334

GOOD = datetime(2007, 12, 1, 22, 20, tzinfo=UTC)
BAD = datetime(2007, 12, 1, 0, 0, tzinfo=UTC)
LIMIT = FlightLimit(2.5, "pdop", "pseudorange")
LAYER_M = 12.0
CEILING_M = 2500.0
# ends of the vertical section, across the canyon: (row, col) of the window
SECTION = ((150, 236), (418, 103))
CUT_ALTITUDE_M = 1000.0


@dataclass(frozen=True, eq=False)
class Scene:
    """One instant of the case: the satellites in the cone, who is in sight where, and the morphing map."""

    when: datetime
    surfaces: MinimumVisibleAltitude
    volume: ControlVolume
    morphing: MorphingMap

    @property
    def grid(self) -> ElevationGrid:
        return self.surfaces.grid


def mountain_almanac(path: Path = ALMANAC_FILE) -> gnss.Almanac:
    """The almanac of the case."""
    return gnss.read_almanac(path, reference=ALMANAC_DATE)


def paper_window(whole: ElevationGrid) -> ElevationGrid:
    """The 10 km × 13 km of the case, out of the whole map."""
    return whole.window(FIRST_ROW, FIRST_ROW + ROWS - 1, FIRST_COL, FIRST_COL + COLS - 1)


def cut_out(surfaces: MinimumVisibleAltitude) -> MinimumVisibleAltitude:
    """Surfaces of the whole map over the case's window, so that the mountains around it hide satellites too."""
    return surfaces.window(FIRST_ROW, FIRST_ROW + ROWS - 1, FIRST_COL, FIRST_COL + COLS - 1)


def scene(whole: ElevationGrid, almanac: gnss.Almanac, when: datetime) -> Scene:
    """The case at one instant; the volume is described, not yet calculated."""
    eyes = satellites.satellite_eyes(whole, almanac, when)
    surfaces = cut_out(min_visible_altitude(whole, eyes.distant_anchors()))
    layers = altitude_layers(float(np.nanmin(surfaces.grid.heights_m)), CEILING_M, LAYER_M)
    volume = control_volume(surfaces, layers, measure=LIMIT.measure, kind=LIMIT.kind)
    return Scene(when, surfaces, volume, morphing_map(surfaces, LIMIT, ceiling_m=CEILING_M))


def sections(shown: Scene) -> tuple[VerticalSection, HorizontalSection]:
    """The cut across the canyon, and the one at CUT_ALTITUDE_M."""
    line = [shown.grid.position_of(*post) for post in SECTION]
    return vertical_section(shown.volume, line), horizontal_section(shown.volume, altitude_m=CUT_ALTITUDE_M)


def open_sky_pdop(shown: Scene) -> float:
    """PDOP in the middle of the window with every satellite of the cone in sight."""
    grid = shown.grid
    east_m, north_m = grid.position_of(grid.rows // 2, grid.cols // 2)
    place_m = (east_m, north_m, float(height_at(grid, east_m, north_m)))
    stand_m = [anchor.position_m(grid) for anchor in shown.surfaces.anchors if isinstance(anchor, DistantAnchor)]
    return float(dop(stand_m, place_m, kind=LIMIT.kind).pdop)


def read_mountains(path: Path = DEM_FILE) -> ElevationGrid:
    """The whole map."""
    return read_dem(path)
