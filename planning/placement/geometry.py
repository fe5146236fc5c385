"""How well spread placed anchors are: the dilution of precision over the targets, whatever the objective was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import dop
from visibility.dilution import least_anchors

from .placing import Placement, positions_of
from .working_out import sight_table

__all__ = ["PlacementGeometry", "placement_geometry"]

# a dilution beyond which one metre of error in the ranges is twenty in the position: as good as none
USELESS_DOP = 20.0


@dataclass(frozen=True, slots=True)
class PlacementGeometry:
    """Dilution of precision over the targets, each counted by its weight.

    median: +inf where half of them or more have no fix. within_limit, no_fix: shares 0..1, of a dilution below the
        goal's dop_limit, and of none at all. useless: of the targets that see enough anchors for a fix, the share whose
        dilution is above 20 or undefined; None where there are none.
    warning: a sentence where that is most of them, else None.
    """

    median: float
    within_limit: float
    no_fix: float
    useless: float | None
    warning: str | None


def placement_geometry(grid: ElevationGrid, placement: Placement) -> PlacementGeometry:
    """The geometry of all anchors of a placement, those that stood before included."""
    anchors, targets, goal = (*placement.fixed, *placement.anchors), placement.targets, placement.goal
    positions_m = positions_of(anchors)
    bits = sight_table(grid, targets, positions_m, placement.sight).table.bits
    visible = np.unpackbits(bits.view(np.uint8), axis=1, bitorder="little")[:, : len(targets)].T.astype(np.bool_)
    normal = targets.normal if goal.on_surface else None
    found = dop(positions_m, targets.point_m, goal.kind, visible=visible, surface_normal=normal)
    value: npt.NDArray[np.float64] = np.asarray(getattr(found, goal.measure), np.float64)

    share = targets.weight / targets.total

    def share_of(which: npt.NDArray[np.bool_]) -> float:
        return float(targets.weight[which].sum() / targets.weight.sum())

    order = np.argsort(value, kind="stable")
    # shares that should sum to a half may fall short of it by rounding
    middle = order[int(np.searchsorted(np.cumsum(share[order]), 0.5 - 1e-9))]
    least = least_anchors(goal.kind, on_surface=goal.on_surface)
    enough = visible.sum(axis=1) >= least
    bad = enough & ~(value <= USELESS_DOP)
    useless = share_of(bad) / share_of(enough) if enough.any() else None
    asked_for_fixes = goal.needed >= least
    return PlacementGeometry(
        float(value[middle]),
        share_of(value < goal.dop_limit),
        share_of(~np.isfinite(value)),
        useless,
        _warning(placement, useless) if asked_for_fixes and useless is not None and useless > 0.5 else None,
    )


def _warning(placement: Placement, useless: float) -> str:
    goal, positions_m = placement.goal, positions_of((*placement.fixed, *placement.anchors))
    in_a_row = len(positions_m) > 2 and np.linalg.matrix_rank(positions_m[1:] - positions_m[0], tol=1.0) < 2
    where = "stand in a row" if in_a_row else "are badly spread"
    cure = "" if goal.objective != "coverage" else ' The objective "dop" (--objective dop) looks for a good spread.'
    return (
        f"The anchors {where}: of the places that see enough of them for a position, {useless:.0%} have a "
        f"{goal.measure.upper()} above {USELESS_DOP:g} or none.{cure}"
    )
