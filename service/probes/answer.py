"""What single places and lines are answered with."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from service.products.lines_of_sight.answer import BlockingPoint

__all__ = ["AnchorSeen", "DilutionOut", "PlaceOut", "ProbeOut", "ProfileOut", "ProfilesOut"]


class AnchorSeen(BaseModel):
    """One anchor from one place."""

    id: str = Field(description="The anchor's id.")
    verdict: Literal["visible", "hidden", "unknown", "out_of_reach"] = Field(
        description="Whether it is in sight; out_of_reach: its antenna's limits leave the place out."
    )
    clearance_m: float | None = Field(
        description="Least height of the line over known ground, metres; negative: hidden by so much; null: none there."
    )
    distance_m: float | None = Field(description="Straight distance, metres; null where the place is unknown.")
    blocking_point: BlockingPoint | None = Field(description="Where it is hidden most; null unless ground hides it.")
    probability_clear: float | None = Field(
        None, description="Probability that the line is clear, 0..1; null without dem_sigma_m."
    )


class DilutionOut(BaseModel):
    """Dilutions of precision by the anchors in sight, no unit; null where there is no fix."""

    gdop: float | None = Field(description="Of everything solved for, no unit.")
    pdop: float | None = Field(description="Of the position, no unit.")
    hdop: float | None = Field(description="Of its horizontal part, no unit.")
    vdop: float | None = Field(description="Of its vertical part, no unit.")
    tdop: float | None = Field(description="Of the clock, no unit; 0 where none is solved for.")
    reason: Literal["ok", "too_few", "singular", "unknown"] = Field(description="Why there is no fix, or ok.")


class PlaceOut(BaseModel):
    """The ground at one place, and what is seen from above it."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    lon_deg: float | None = Field(description="Longitude, degrees; null for a DEM without CRS.")
    lat_deg: float | None = Field(description="Latitude, degrees; null for a DEM without CRS.")
    ground_m: float | None = Field(description="Altitude of the ground, metres; null where it is unknown or no DEM is.")
    slope_deg: float | None = Field(description="How steep the ground is, degrees; null where unknown.")
    downhill_deg: float | None = Field(
        description="Which way it falls, degrees clockwise from grid north; null where level or unknown."
    )
    receiver_altitude_m: float | None = Field(description="Altitude of the receiver, metres; null over unknown ground.")
    anchors: list[AnchorSeen] = Field(description="Every anchor, in the order of the request.")
    visible_anchors: int = Field(description="How many are in sight.")
    dilution: DilutionOut | None = Field(description="By the anchors in sight; null without anchors.")
    position_sigma_m: float | None = Field(description="One-sigma error of a fix by them, metres; null without a fix.")
    horizontal_sigma_m: float | None = Field(description="Its horizontal part, metres; null without a fix.")


class ProbeOut(BaseModel):
    """The answer, place by place."""

    points: list[PlaceOut] = Field(description="The places, in the order of the request.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")


class ProfileOut(BaseModel):
    """The ground under one line, as columns of numbers; null where the ground is unknown."""

    verdict: Literal["clear", "blocked", "unknown"] = Field(description="Whether the line is clear of the surface.")
    clearance_m: float | None = Field(description="Least height of the line over known ground, metres.")
    distance_m: list[float] = Field(description="Horizontal distance from the first point, metres, rising.")
    ground_m: list[float | None] = Field(description="Altitude of the ground there, metres.")
    line_m: list[float] = Field(description="Altitude of the line there, metres; with curvature it sags.")
    fresnel_radius_m: list[float] | None = Field(
        None, description="Radius of the first Fresnel zone there, metres; null without a wavelength."
    )
    fresnel_clearance: float | None = Field(None, description="Least clearance in radii of that zone, no unit.")
    blocking_point: BlockingPoint | None = Field(description="Where it is blocked most; null unless it is.")
    blocking_distance_m: float | None = Field(description="Horizontal distance to it, metres; null unless blocked.")


class ProfilesOut(BaseModel):
    """The answer, line by line."""

    profiles: list[ProfileOut] = Field(description="The lines, in the order of the request.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
