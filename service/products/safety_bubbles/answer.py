"""Safety bubbles as they are answered."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from service.parts.map_facts import Ground
from service.parts.positioning_answers import PlacedAnchor, PlacedSatellite

__all__ = ["BubbleOut", "BuildingFacts", "FirstViolation", "SafetyBubblesSummary"]


class BubbleOut(BaseModel):
    """The bubble at one point."""

    time_s: float = Field(description="When, seconds.")
    distance_m: float = Field(description="Way along the path up to here, metres.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Altitude in the DEM's vertical datum, metres.")
    radius_m: float = Field(description="Radius of the bubble, metres.")
    promise: float = Field(
        description="Probability that a bubble of this covariance, without dem_sigma_m, holds it, 0..1."
    )
    clearance_m: float = Field(
        description="Distance to the nearest ground or building in space, metres; negative: below or inside."
    )
    margin_m: float = Field(description="Clearance less radius, metres.")
    nearest: Literal["ground", "building"] = Field("ground", description="What that nearest place belongs to.")
    verdict: Literal["ok", "violated", "unknown"] = Field(
        description="unknown: unknown ground may be nearer than the radius."
    )
    push: tuple[float, float, float] = Field(
        description="Unit vector away from that place, or out through it: east, north, up."
    )
    push_m: float = Field(description="How far to go that way, metres; 0 where all is well.")
    in_sight: list[str] | None = Field(description="Anchors surely in sight; null in a history of poses.")


class FirstViolation(BaseModel):
    """The first point whose bubble touches the ground or a building."""

    point: int = Field(description="Its number, 0 the first.")
    time_s: float = Field(description="When, seconds.")
    distance_m: float = Field(description="Way along the path up to there, metres.")
    radius_m: float = Field(description="Radius, metres.")
    clearance_m: float = Field(description="Clearance, metres.")
    margin_m: float = Field(description="Clearance less radius, metres.")
    nearest: Literal["ground", "building"] = Field("ground", description="What it touches.")
    in_sight: list[str] | None = Field(description="Anchors surely in sight there; null in a history of poses.")


class BuildingFacts(BaseModel):
    """A building mesh."""

    name: str = Field(description="Name of its file.")
    bodies: int = Field(description="Number of bodies.")
    triangles: int = Field(description="Number of triangles.")
    points_nearest: int = Field(description="Number of points that it is nearest to.")


class SafetyBubblesSummary(BaseModel):
    """All bubbles in numbers, and how far to trust them."""

    points: int = Field(description="Number of points.")
    ok: int = Field(description="Number of points whose bubble is clear of ground and buildings.")
    violated: int = Field(description="Number of points whose bubble is not.")
    unknown: int = Field(description="Number of points near unknown ground.")
    first_violation: FirstViolation | None = Field(description="The first violated point; null where there is none.")
    least_margin_m: float = Field(description="Smallest margin, metres.")
    radius_quantiles_m: dict[str, float] = Field(description="p05, p50 and p95 of the radius, metres.")
    epsilon: float = Field(description="How many sigmas the radius is, no unit.")
    least_promise: float = Field(description="Smallest promise of all points, 0..1.")
    error_statement: str | None = Field(description="Error of the sight lines; null in a history of poses.")
    curvature: str | None = Field(description="Curvature and refraction that were used; null in a history of poses.")
    dem: Ground
    buildings: BuildingFacts | None = Field(None, description="The building mesh; null without one.")
    anchors: list[PlacedAnchor]
    satellites: list[PlacedSatellite]
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    version: str = Field(description="Version of Sightline that calculated it.")
