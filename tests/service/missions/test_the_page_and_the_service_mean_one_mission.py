"""The planner's page and the service have the same mission, field by field."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from service.missions import document

SOURCE = Path(__file__).parents[3] / "service" / "page" / "src" / "mission" / "mission.ts"
MODELS = {
    "Mission": document.MissionIn,
    "GroundRef": document.GroundRef,
    "Anchor": document.MissionAnchor,
    "Buildings": document.MissionBuildings,
    "Trees": document.MissionTrees,
    "Rover": document.MissionRover,
    "Positioning": document.MissionPositioning,
    "Route": document.MissionRoute,
    "Placing": document.MissionPlacing,
    "StandOff": document.MissionStandOff,
    "Rules": document.MissionRules,
    "Orbits": document.MissionOrbits,
    "Times": document.MissionTimes,
    "Flight": document.MissionFlight,
}
PLACE, FILE_ALONE = {"east_m", "north_m"}, {"format"}


def interfaces() -> dict[str, set[str]]:
    found = re.findall(r"^export interface (\w+)[^{]*\{(.*?)^\}", SOURCE.read_text(encoding="utf-8"), re.S | re.M)
    return {name: set(re.findall(r"^  readonly (\w+):", body, re.M)) for name, body in found}


@pytest.mark.parametrize("name", MODELS)
def test_each_part_has_the_same_fields(name: str) -> None:
    ours = set(MODELS[name].model_fields) - FILE_ALONE - (PLACE if name == "Anchor" else set())
    assert interfaces()[name] == ours


def test_no_part_is_forgotten() -> None:
    assert set(interfaces()) == set(MODELS)


@pytest.mark.parametrize(
    "trees",
    [
        {"what": "top"},
        {"what": "top", "top_m": 18.0, "name": "crowns.tif", "base64": "TQ=="},
        {"what": "heights", "top_m": 18.0},
        {"what": "surface", "name": "surface.tif"},
    ],
)
def test_trees_that_are_neither_one_height_nor_one_file_are_refused(trees: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="Trees of one height need top_m alone"):
        document.MissionTrees.model_validate(trees)
