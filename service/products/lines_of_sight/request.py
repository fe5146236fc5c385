"""Lines of sight: pairs of points in, clearance and verdict of each out."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from service.parts.job_answers import JobOut
from service.parts.older_results import OrOlder
from service.parts.pages import Page
from service.parts.points import Metres, PointIn, Positive, StrictModel
from service.parts.sight import CurvatureChoice

__all__ = [
    "LineOut",
    "LinesOfSightIn",
    "LinesOfSightList",
    "LinesOfSightOut",
    "LinesOfSightState",
    "LinesOfSightSummary",
    "PairIn",
]

SPEED_OF_LIGHT_M_PER_S = 299_792_458.0
DEM_ID = "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11"
FROM: dict[str, Any] = {"east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0}
TO: dict[str, Any] = {"east_m": 398100.0, "north_m": 3791700.0, "above_ground_m": 1.5}
PAIRS: dict[str, Any] = {"dem_id": DEM_ID, "pairs": [{"from": FROM, "to": TO}], "frequency_hz": 2.4e9}
ARRAYS: dict[str, Any] = {
    "dem_id": DEM_ID,
    "from_points_m": [[402300.0, 3795200.0, 1450.0]],
    "to_points_m": [[398100.0, 3791700.0, 612.5]],
}

Point3 = tuple[Metres, Metres, Metres]


class PairIn(StrictModel):
    """Two points; the line between them is straight."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"from": FROM, "to": TO}]})

    from_: PointIn = Field(alias="from", description="One end.")
    to: PointIn = Field(description="The other end.")


class LinesOfSightIn(StrictModel):
    """Pairs of points on a DEM, as objects or, shorter, as two arrays of east, north and altitude in metres."""

    model_config = ConfigDict(json_schema_extra={"examples": [PAIRS, ARRAYS]})

    dem_id: str = Field(min_length=1, max_length=64, description="The DEM, as POST /dems named it.")
    pairs: list[PairIn] | None = Field(None, description="The pairs as objects; or give both arrays.")
    from_points_m: list[Point3] | None = Field(
        None, description="One end of each line: [east, north, altitude] in metres; goes with to_points_m."
    )
    to_points_m: list[Point3] | None = Field(
        None, description="The other end of each line: [east, north, altitude] in metres; goes with from_points_m."
    )
    wavelength_m: Positive | None = Field(
        None, description="Asks for the Fresnel clearance at this wavelength, metres; or give frequency_hz."
    )
    frequency_hz: Positive | None = Field(
        None, description="Asks for the Fresnel clearance at this frequency, hertz; or give wavelength_m."
    )
    dem_sigma_m: Positive | None = Field(
        None, description="Asks for the probability of sight under this one-sigma height error of the DEM, metres."
    )
    excess_path: bool = Field(True, description="Whether to calculate excess_path_m.")
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    @model_validator(mode="after")
    def _one_form_of_pairs_and_one_wavelength(self) -> Self:
        arrays = (self.from_points_m, self.to_points_m)
        if (self.pairs is not None) == any(array is not None for array in arrays):
            raise ValueError("Give either pairs or both from_points_m and to_points_m.")
        if self.pairs is None and any(array is None for array in arrays):
            raise ValueError("from_points_m and to_points_m go together.")
        lengths = {len(points) for points in (self.pairs, *arrays) if points is not None}
        if len(lengths) > 1:
            raise ValueError("from_points_m and to_points_m must be equally long.")
        if lengths == {0}:
            raise ValueError("At least one pair of points is needed.")
        if self.wavelength_m is not None and self.frequency_hz is not None:
            raise ValueError("Give wavelength_m or frequency_hz, not both.")
        return self

    @property
    def asked_wavelength_m(self) -> float | None:
        """The wavelength, whichever way it was given."""
        return self.wavelength_m if self.frequency_hz is None else SPEED_OF_LIGHT_M_PER_S / self.frequency_hz


class BlockingPoint(BaseModel):
    """Where known ground stands in the way most."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Altitude of the ground there, metres.")


class LineOut(BaseModel):
    """One line of sight."""

    verdict: Literal["clear", "blocked", "unknown"] = Field(
        description="Whether the line is clear of the surface; unknown when it crosses unknown ground and no known "
        "ground blocks it."
    )
    clearance_m: float | None = Field(
        description="Least height of the line over known ground, metres; negative: blocked by so much; null: no known "
        "ground under it."
    )
    distance_m: float = Field(description="Straight distance between the points, metres.")
    blocking_point: BlockingPoint | None = Field(
        description="Where it is blocked most; null unless known ground blocks."
    )
    over_unknown: bool = Field(description="Whether the line crosses unknown ground.")
    fresnel_clearance: float | None = Field(
        None, description="Least clearance in radii of the first Fresnel zone, no unit; null without a wavelength."
    )
    excess_path_m: float | None = Field(
        None,
        description="How much longer the shortest way over the ground is than the line, metres; 0 when clear; null: an "
        "end lies below the ground, or unknown, or not asked for.",
    )
    probability_clear: float | None = Field(
        None, description="Probability that the line is clear, 0..1; null without dem_sigma_m."
    )


class LinesOfSightSummary(BaseModel):
    """All lines in numbers, and how far to trust them."""

    lines: int = Field(description="Number of lines.")
    clear: int = Field(description="Lines that are clear.")
    blocked: int = Field(description="Lines that are blocked.")
    unknown: int = Field(description="Lines that are unknown.")
    error_statement: str = Field(description="Error of the method.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    version: str = Field(description="Version of Sightline that calculated it.")


class LinesOfSightState(JobOut):
    """How a calculation of lines of sight stands."""

    request: dict[str, Any] = Field(description="The options that were asked for, and the number of pairs.")
    result: OrOlder[LinesOfSightSummary] = Field(description="The lines in numbers; null until it succeeded.")
    files: list[str] = Field(description="Paths of lines.json and lines.npz (arrays for numpy); empty until then.")


class LinesOfSightOut(LinesOfSightState):
    """The same with every line, in the order of the pairs."""

    lines: list[LineOut] | None = Field(description="One entry per pair, in their order; null until it succeeded.")


class LinesOfSightList(Page):
    """One page of lines-of-sight calculations, newest first, without their lines."""

    lines_of_sight: list[LinesOfSightState]
