"""Lines of sight as they are answered."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

__all__ = ["BlockingPoint", "LineOut", "LinesOfSightSummary"]


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
        None,
        description="Least clearance in radii of the first Fresnel zone, no unit; null without a wavelength and over "
        "unknown ground.",
    )
    excess_path_m: float | None = Field(
        None,
        description="How much longer the shortest way over the ground is than the line, metres; 0 when clear; null: an "
        "end lies below the ground, or unknown, or not asked for.",
    )
    probability_clear: float | None = Field(
        None,
        description="Probability that the line is clear, 0..1; null without dem_sigma_m, and over unknown ground "
        "unless known ground blocks it.",
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
