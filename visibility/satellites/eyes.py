"""satellite_eyes: satellites as directions in a grid's own axes, for the line-of-sight machinery."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.gps_time import Moments
from gnss.sky import ConeAxis, Place
from terrain import ElevationGrid, FrameError
from visibility.sight.anchors import DistantAnchor

from ..errors import VisibilityInputError
from .in_view import DEFAULT_CONE_RAD, Constellation, SatellitesInView, satellites_in_view, true_to_grid

__all__ = ["SatelliteEyes", "SatelliteTrack", "satellite_eyes", "satellite_tracks"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SatelliteEyes:
    """The answer to ``satellite_eyes``; arrays are (n_satellites, n_times), rows as ``view.ids``.

    azimuth_rad: clockwise from GRID north, 0…2π. elevation_rad: of the line as it stands over the grid's metres, which
        differ from true ones by the CRS's scale. range_m: true slant distance.
    convergence_rad: grid azimuth of true north at the place.
    """

    view: SatellitesInView
    azimuth_rad: Array
    elevation_rad: Array
    range_m: Array
    convergence_rad: float

    def distant_anchors(self, time: int = 0, *, ranging_sigma_m: float = 1.0) -> tuple[DistantAnchor, ...]:
        """The satellites in view, above the horizon, at the instant of that index, as anchors."""
        above = self.view.in_view[:, time] & (self.elevation_rad[:, time] > 0.0)
        return tuple(
            DistantAnchor(
                self.view.ids[row],
                float(self.azimuth_rad[row, time]),
                float(self.elevation_rad[row, time]),
                float(self.range_m[row, time]),
                ranging_sigma_m,
            )
            for row in np.flatnonzero(above)
        )


def satellite_eyes(
    grid: ElevationGrid,
    constellation: Constellation,
    times: Moments,
    cone_rad: float = DEFAULT_CONE_RAD,
    *,
    place: Place | None = None,
    axis: ConeAxis = "geocentric",
    leap_seconds: int | None = None,
    max_age_s: float | None = None,
) -> SatelliteEyes:
    """Directions of the satellites in a grid's axes, as seen from its middle.

    place: where a grid without CRS lies, its north then taken as true; None for a grid that has one.
    Other arguments as in ``satellites_in_view``.
    Raises AlmanacError, VisibilityInputError, FrameError.
    """
    if place is not None and grid.crs is not None:
        raise FrameError("The DEM has a CRS and with it a place on Earth; leave out the other place.")
    view = satellites_in_view(
        constellation, times, grid if place is None else place, cone_rad,
        axis=axis, leap_seconds=leap_seconds, max_age_s=max_age_s,
    )  # fmt: skip
    matrix = true_to_grid(grid, view.place)
    across = np.cos(view.elevation_rad)
    true_east, true_north = across * np.sin(view.azimuth_rad), across * np.cos(view.azimuth_rad)
    east = matrix[0, 0] * true_east + matrix[0, 1] * true_north
    north = matrix[1, 0] * true_east + matrix[1, 1] * true_north
    return SatelliteEyes(
        view=view,
        azimuth_rad=np.arctan2(east, north) % (2.0 * np.pi),
        elevation_rad=np.arctan2(np.sin(view.elevation_rad), np.hypot(east, north)),
        range_m=view.range_m,
        convergence_rad=float(np.arctan2(matrix[0, 1], matrix[1, 1])),
    )


@dataclass(frozen=True, slots=True, eq=False)
class SatelliteTrack:
    """One satellite at some times (seconds, as frames count them); None where it is out of view then."""

    id: str
    stands: Mapping[float, DistantAnchor | None]

    def at(self, time_s: float) -> DistantAnchor | None:
        """The satellite at one of its times; raises VisibilityInputError at any other."""
        if time_s not in self.stands:
            raise VisibilityInputError(
                f"Satellite {self.id} is known at {len(self.stands)} instants only, and {time_s:g} s is none of them."
            )
        return self.stands[time_s]


def satellite_tracks(
    eyes: SatelliteEyes, times_s: Sequence[float], *, ranging_sigma_m: float = 1.0
) -> tuple[SatelliteTrack, ...]:
    """Those that are in view at some time, as ``morphing_frames`` takes them.

    times_s: what frames call the instants of ``eyes``, one for each. Raises VisibilityInputError.
    """
    instants = eyes.azimuth_rad.shape[1]
    if len(times_s) != instants:
        raise VisibilityInputError(f"Satellites stand at {instants} instants; {len(times_s)} times were given.")
    seen = [
        {anchor.id: anchor for anchor in eyes.distant_anchors(number, ranging_sigma_m=ranging_sigma_m)}
        for number in range(instants)
    ]
    return tuple(
        SatelliteTrack(name, {float(time_s): here.get(name) for time_s, here in zip(times_s, seen, strict=True)})
        for name in eyes.view.ids
        if any(name in here for here in seen)
    )
