"""Placements as the service tells about them."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from service.parts.map_answers import DEM_ID, DemId, MapOut, MapSummary, running_example
from service.parts.older_results import OrOlder
from service.parts.pages import Page
from service.products.placements.request import PlacementParameters

__all__ = ["PlacementIn", "PlacementList", "PlacementOut", "PlacementSummary"]

REQUEST: dict[str, Any] = {
    "dem_id": DEM_ID,
    "count": 6,
    "candidates": [{"spacing_m": 1500.0, "above_ground_m": [80.0, 120.0]}],
    "targets": {"receiver_above_ground_m": 1.5},
    "goal": {"objective": "dop", "visible": 4, "dop_limit": 5.0},
    "rules": {"max_range_m": 8000.0, "min_separation_m": 300.0},
}


class PlacementIn(PlacementParameters):
    """A DEM, candidates, where they shall be seen, rules and what is good."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId


class PlacedOut(BaseModel):
    """A placed anchor; shares for coverage and dop, metres for errors."""

    model_config = ConfigDict(extra="allow")

    id: str = Field(description="Name of the anchor, in the order in which each adds most.")
    what: str = Field(description="drone, mast or site.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")


class CandidatesOut(BaseModel):
    """What became of the candidates."""

    left: int = Field(description="How many candidates kept every rule.")
    removed: dict[str, int] = Field(description="How many each rule took away, in the order of the rules.")


class HoverOut(BaseModel):
    """The value when every placed anchor hovers off its place; shares or metres."""

    model_config = ConfigDict(extra="allow")

    hover_m: float = Field(description="Off by up to so much in each direction, metres.")
    draws: int = Field(description="How many random ones there were.")


class DilutionOut(BaseModel):
    """How well spread all anchors are, over the targets and by their weight."""

    measure: str = Field(description="gdop, pdop, hdop or vdop, as the goal says.")
    median: float | None = Field(description="Half the targets have at most this (no unit); null if half have no fix.")
    within_limit_share: float = Field(description="Share of the targets with at most the goal's dop_limit, 0..1.")
    no_fix_share: float = Field(description="Share of the targets without any fix, 0..1.")
    useless_share: float | None = Field(
        description="Of the targets that see enough anchors for a fix: the share above 20 or without one, 0..1; null "
        "where there are none. A warning tells when it is most of them."
    )


class PlacementSummary(MapSummary):
    """What was placed and what it is worth; shares 0..1 for coverage and dop, metres for errors."""

    objective: str = Field(description="coverage, dop, mean_error or worst_error.")
    goal: str = Field(description="The same in words, with its limits.")
    placed: list[PlacedOut]
    candidates: CandidatesOut
    dilution: DilutionOut
    hover: HoverOut
    method: str = Field(description="exact, local search or greedy.")
    proved: bool = Field(description="Whether no other choice is better.")
    stopped: bool = Field(description="Whether a time limit or somebody ended the search: this is the best so far.")
    statement: str = Field(description="What is proved about greedy for this goal.")


class PlacementOut(MapOut):
    """A placement: how its calculation stands, and its result when it has one."""

    model_config = ConfigDict(json_schema_extra={"examples": [running_example("/placements", REQUEST)]})

    result: OrOlder[PlacementSummary] = Field(description="What was placed; null until it succeeded.")


class PlacementList(Page):
    """One page of placements, newest first."""

    placements: list[PlacementOut]
