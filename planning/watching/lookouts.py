"""Where a session looks at its map: anchors as they stand now, with their radios, and what earlier drives said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely

from detection import PositionFix, RangingAnchor
from planning.errors import WatchError
from terrain import ElevationGrid
from visibility import Anchor, Curvature
from visibility.sight import SightDoubt
from visibility.signal import Radio

from .arrivals import arrivals
from .forecasts import (
    GroundErrors,
    SightForecast,
    check_antenna,
    forecast_sight,
    mixed_with_doubts,
    strange_anchors,
    warnings_over,
)

__all__ = ["Lookout"]

UNHEARD = "Not looked at: the canopy, since no anchor has a radio; trees hide nothing."


class Lookout:
    """A map with the anchors that are looked for over it; changed in place as they move.

    area: where the rover is outside it, the map is not asked. doubts, radios: by anchor; doubts are forgotten of one
    that moves. warnings: what is to be known of the anchors over the map, and of their signals. Raises WatchError.
    """

    def __init__(
        self,
        grid: ElevationGrid,
        anchors: Sequence[RangingAnchor],
        antenna_above_ground_m: float,
        curvature: Curvature | None,
        area: shapely.Geometry | None,
        doubts: Mapping[str, tuple[SightDoubt, ...]],
        radios: Mapping[str, Radio],
    ) -> None:
        check_antenna(antenna_above_ground_m)
        self.grid, self.antenna_above_ground_m = grid, antenna_above_ground_m
        self.curvature = Curvature.over(grid, curvature)
        self.doubts, self.radios = dict(doubts), dict(radios)
        self.places_m = {anchor.id: (anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in anchors}
        self._area = area
        self.warnings = (*warnings_over(grid, anchors), *self._heard())
        self._stand()

    def move(self, moved: Sequence[RangingAnchor]) -> None:
        """Anchors that are elsewhere from now on; strange ones are passed over."""
        for anchor in moved:
            if anchor.id in self.places_m:
                self.places_m[anchor.id] = (anchor.east_m, anchor.north_m, anchor.altitude_m)
                self.doubts.pop(anchor.id, None)
        if moved:
            self._stand()

    def ranging(self) -> list[RangingAnchor]:
        """The anchors for a detector."""
        return [RangingAnchor(anchor_id, *at_m) for anchor_id, at_m in self.places_m.items()]

    def standing(self) -> list[Anchor]:
        """The same for plans, with their radios and what earlier drives said."""
        return [
            Anchor(one, *at_m, radio=self.radios.get(one), doubts=self.doubts.get(one, ()))
            for one, at_m in self.places_m.items()
        ]

    def forecast(self, place: PositionFix, errors: GroundErrors, excess_m: float) -> SightForecast | None:
        """What the map says at a place, as ``forecast_sight``; NaN of anchors of which it can say nothing."""
        if self._area is not None and not shapely.intersects_xy(self._area, *place.position_m[:2]):
            return None
        strange = self._strange
        ends_m = np.where(strange[:, None], [*place.position_m[:2], 0.0], self._places_m)
        found = forecast_sight(
            *(self.grid, place.position_m, place.covariance_m2, ends_m, self.antenna_above_ground_m),
            excess_m=excess_m, errors=errors, curvature=self.curvature, radios=self._radios,
        )  # fmt: skip
        if found is None:
            return None
        for answer in (found.p_sight, found.p_direct, found.clearance_m, found.p_usable, found.margin_db):
            answer[strange] = np.nan
        if not self.doubts:
            return found
        p_sight, p_direct = (
            mixed_with_doubts(p[None], tuple(self.places_m), self.doubts, place.position_m[None])[0]
            for p in (found.p_sight, found.p_direct)
        )
        return replace(found, p_sight=p_sight, p_direct=p_direct)

    def _stand(self) -> None:
        self._places_m = np.array(list(self.places_m.values())).reshape(-1, 3)
        self._strange = strange_anchors(self.grid, self.places_m)
        self._radios = [self.radios.get(anchor_id) for anchor_id in self.places_m]

    def _heard(self) -> tuple[str, ...]:
        """What is to be known of the anchors' signals over this ground."""
        if strange := sorted(self.radios.keys() - self.places_m.keys()):
            raise WatchError(f"There is no anchor {strange[0]!r} for this radio.")
        if not self.radios:
            return () if self.grid.trees is None else (UNHEARD,)
        ends_m, radios = np.array(list(self.places_m.values())), [self.radios.get(one) for one in self.places_m]
        return arrivals(self.grid, ends_m.mean(axis=0)[None], ends_m, radios, self.curvature).notes
