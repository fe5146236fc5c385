"""Whether measurements of one epoch agree with one another, and which do not (seed 002, eqs. 2.6-2.12)."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import numbers
from .chi_square import chi_square_limits
from .kernels import parity as kernel

__all__ = ["EpochVerdict", "ParityEpochs", "Use", "judge_epochs", "whiten"]

Array = npt.NDArray[np.float64]

MOST_MEASUREMENTS = 64
# sets of six of 64 are 75 million, and no sky has that many liars that agree on nothing
MOST_EXCLUDED = 6
MOST_SETS = 2_000_000


class EpochVerdict(enum.IntEnum):
    """What is found of an epoch.

    UNTESTABLE: no redundancy, or too little geometry. CLEAR: the measurements agree. EXPLAINED: they do without one set
    of them, and that set only. AMBIGUOUS: without any of several sets of that size. UNEXPLAINED: no set allowed does.
    """

    UNTESTABLE = kernel.UNTESTABLE
    CLEAR = kernel.CLEAR
    EXPLAINED = kernel.EXPLAINED
    AMBIGUOUS = kernel.AMBIGUOUS
    UNEXPLAINED = kernel.UNEXPLAINED


class Use(enum.IntEnum):
    """What becomes of a measurement; SUSPECTED: kept, but a set with it explains the epoch as well as the one taken."""

    LEFT_OUT = kernel.LEFT_OUT
    KEPT = kernel.KEPT
    EXCLUDED = kernel.TAKEN_OUT
    SUSPECTED = kernel.SUSPECTED


@dataclass(frozen=True, eq=False)
class ParityEpochs:
    """The answer to ``judge_epochs`` for e epochs of m measurements with n unknowns.

    verdict: (e,) EpochVerdict; use: (e, m) Use, both uint8. solution: (e, n) least squares of what is kept, NaN where
    the geometry gives none. statistic, degrees: (e,) squared length of the parity vector in sigmas, chi-square of so
    many degrees where nothing is wrong; remaining: (e,) the same after the exclusion, of as many less degrees.
    worst_element: (e,) largest parity element in its own sigmas, 0 unless asked for. wrong_by: (e, m) estimated error
    of what is excluded, in the unit of the measurements, 0 elsewhere.
    """

    verdict: npt.NDArray[np.uint8]
    use: npt.NDArray[np.uint8]
    solution: Array
    statistic: Array
    degrees: npt.NDArray[np.int64]
    remaining: Array
    worst_element: Array
    wrong_by: Array

    @property
    def alarm(self) -> npt.NDArray[np.bool_]:
        """(e,) whether the measurements disagree."""
        return self.verdict >= EpochVerdict.EXPLAINED


def judge_epochs(
    rows: npt.ArrayLike,
    measured: npt.ArrayLike,
    sigmas: npt.ArrayLike,
    *,
    false_alarm: float = 1e-3,
    elements_sigma: float = 0.0,
    most_excluded: int = 3,
) -> ParityEpochs:
    """Test each epoch's measurements = rows·x + noise against one another, and leave out the fewest that disagree.

    rows: (e, m, n): unit vectors, and 1 for a clock where there is one. measured: (e, m), NaN = none. sigmas: (e, m),
        (m,) or one for all, above 0; inf = left out, such as what is predicted hidden. Of temporal differences they are
        those of the differences (eq. 2.12), √2 times those of a phase.
    false_alarm: rate at which an epoch of right measurements is alarmed by the chi-square test.
    elements_sigma: 3.0 alarms as printed instead, where any parity element passes so many of its own sigmas; an epoch
        of d degrees is then alarmed falsely at a rate of 1 - 0.9973^d.
    most_excluded: sets up to this size are tried, all of them, the smallest first; one measurement more than that and
        the unknowns must remain.
    Raises MeasurementError.
    """
    z = np.array(measured, np.float64)
    if z.ndim != 2:
        raise MeasurementError(f"measured must be (epochs, measurements), not shape {z.shape}.")
    epochs, count = z.shape
    a = np.array(rows, np.float64, order="C")
    if a.ndim != 3 or a.shape[:2] != z.shape or not a.shape[2] >= 1:
        raise MeasurementError(f"rows must be (epochs, measurements, unknowns) for measured {z.shape}, not {a.shape}.")
    if count > MOST_MEASUREMENTS:
        raise MeasurementError(f"An epoch may hold {MOST_MEASUREMENTS} measurements, not {count}.")
    try:
        s = np.array(np.broadcast_to(np.asarray(sigmas, np.float64), z.shape), order="C")
    except (TypeError, ValueError) as error:
        raise MeasurementError(f"sigmas must be one for each of {z.shape} measurements, or fewer alike.") from error
    if not (s > 0.0).all():
        raise MeasurementError("sigmas must be above zero, inf for what is to be left out.")
    taken = np.isfinite(s) & ~np.isnan(z)
    if np.isinf(z).any() or not np.isfinite(a[taken]).all():
        raise MeasurementError("measured must be finite or NaN, and the rows of what is measured finite.")
    if not 0.0 <= elements_sigma < math.inf:
        raise MeasurementError(f"elements_sigma must be zero or more, not {elements_sigma}.")
    largest = min(most_excluded, count)
    if not 0 <= most_excluded <= MOST_EXCLUDED or math.comb(count, largest) > MOST_SETS:
        raise MeasurementError(
            f"most_excluded must be 0 to {MOST_EXCLUDED}, and make {MOST_SETS:,} sets of {count} measurements at most."
        )
    found = np.zeros((epochs, 5))
    marks, verdicts = np.zeros(z.shape, np.uint8), np.zeros(epochs, np.uint8)
    solutions, wrong_by = np.full((epochs, a.shape[2]), math.nan), np.zeros(z.shape)
    limits = kernel.Limits(float(elements_sigma), int(most_excluded))
    critical = chi_square_limits(false_alarm, max(count, 1))
    kernel.judge_epochs(a, z, s, critical, limits, found, marks, (solutions, wrong_by, verdicts))
    return ParityEpochs(
        verdicts,
        marks,
        solutions,
        found[:, kernel.STATISTIC].copy(),
        found[:, kernel.DEGREES].astype(np.int64),
        found[:, kernel.REMAINING].copy(),
        found[:, kernel.WORST].copy(),
        wrong_by,
    )


def whiten(rows: npt.ArrayLike, measured: npt.ArrayLike, covariance: npt.ArrayLike) -> tuple[Array, Array]:
    """(rows (m, n), measured (m,)) of unit and independent noise, from those of noise with covariance (m, m).

    For measurements that share noise, such as differences that share a phase; ``judge_epochs`` takes them with a sigma
    of 1. What is excluded afterwards is a combination, the i-th measurement less what those before it foretell of it.
    Raises MeasurementError.
    """
    z = np.array(measured, np.float64)
    a = numbers("rows", rows, (z.size, np.shape(rows)[-1] if np.ndim(rows) == 2 else 0))
    try:
        root = np.linalg.cholesky(numbers("covariance", covariance, (z.size, z.size)))
    except np.linalg.LinAlgError as error:
        raise MeasurementError("covariance of the measurements is not positive.") from error
    return np.linalg.solve(root, a), np.linalg.solve(root, z)
