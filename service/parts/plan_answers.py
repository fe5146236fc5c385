"""What the answers of planned paths and flights have in common: how a plan ends, and the validator's report."""

from __future__ import annotations

import math

from pydantic import BaseModel, Field

from planning.validation import LimitCheck, PathLimit, PathValidation

__all__ = [
    "AngleCheckOut",
    "LimitCheckOut",
    "PathPlaceOut",
    "ValidationOut",
    "finite",
    "place_answer",
    "validation_answer",
]

ANGLES = {PathLimit.SLOPE, PathLimit.PITCH, PathLimit.ROLL, PathLimit.START_HEADING}


class PathPlaceOut(BaseModel):
    """A place on the ground."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")


class CheckOut(BaseModel):
    """The validator's check of one limit."""

    limit: str = Field(description="Which limit.")
    kept: bool = Field(description="Whether it holds everywhere.")
    broken: int = Field(description="At how many of the samples it does not.")
    where: PathPlaceOut


class AngleCheckOut(CheckOut):
    """The validator's check of a limit on an angle."""

    worst_deg: float | None = Field(description="The value that comes nearest to the limit or breaks it most, degrees.")
    allowed_deg: float | None = Field(description="The limit, degrees.")


class LimitCheckOut(CheckOut):
    """The validator's check of any other limit."""

    worst: float | None = Field(
        description="The value that comes nearest to the limit or breaks it most, metres or a number; null: none is "
        "known, or it has no bound."
    )
    allowed: float | None = Field(description="The limit, metres or a number; null: it has no bound.")


class ValidationOut(BaseModel):
    """The report of the validator, which shares no code with the planner."""

    passed: bool = Field(description="Whether every limit holds.")
    sentence: str = Field(description="The same in words.")
    step_m: float = Field(description="Distance between samples at most, metres.")
    samples: int = Field(description="How many samples there were.")
    checks: list[AngleCheckOut | LimitCheckOut]


def validation_answer(validation: PathValidation) -> ValidationOut:
    """The validator's report, angles in degrees."""
    return ValidationOut(
        passed=validation.passed,
        sentence=validation.sentence,
        step_m=validation.step_m,
        samples=validation.samples,
        checks=[_check(check) for check in validation.checks],
    )


def place_answer(place_m: tuple[float, float]) -> PathPlaceOut:
    """A place, (east_m, north_m)."""
    return PathPlaceOut(east_m=place_m[0], north_m=place_m[1])


def finite(value: float) -> float | None:
    """JSON knows neither NaN nor infinity: None."""
    return float(value) if math.isfinite(value) else None


def _check(check: LimitCheck) -> AngleCheckOut | LimitCheckOut:
    limit, where = str(check.limit), place_answer(check.where_m)
    if check.limit in ANGLES:
        return AngleCheckOut(
            limit=limit,
            kept=check.kept,
            broken=check.broken,
            where=where,
            worst_deg=finite(math.degrees(check.worst)),
            allowed_deg=finite(math.degrees(check.allowed)),
        )
    return LimitCheckOut(
        limit=limit,
        kept=check.kept,
        broken=check.broken,
        where=where,
        worst=finite(check.worst),
        allowed=finite(check.allowed),
    )
