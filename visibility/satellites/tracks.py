"""Satellites over hours as anchors that move: each a direction at a few instants, between them nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from visibility.sight.distant import DistantAnchor

from ..errors import VisibilityInputError
from .eyes import SatelliteEyes

__all__ = ["SatelliteTrack", "satellite_tracks"]


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
