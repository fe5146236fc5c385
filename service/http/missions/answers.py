"""How the service tells about missions and their versions."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from service.access.callers import rooted
from service.http.answers import LayerLink
from service.http.lists import Page
from service.missions.document import MissionIn, PlainName
from service.missions.files import MISSION_FILES
from service.missions.shelf import MissionRecord, VersionRecord
from service.parts.points import StrictModel

__all__ = ["MissionList", "MissionOut", "MissionSummary", "VersionList", "VersionName", "VersionNameIn", "VersionOut"]

MISSION_ID = "7c1e0b5d2f8a4f36a9c3d1e5b7f90a24"
EXAMPLE: dict[str, JsonValue] = {
    "id": MISSION_ID,
    "name": "Valley crossing",
    "version": 7,
    "dem_id": "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11",
    "ground": "valley.npz",
    "anchors": 3,
    "created_at": "2026-05-01T06:30:00Z",
    "saved_at": "2026-05-01T07:12:44Z",
    "saved_by": "Ada",
    "links": {"self": f"/missions/{MISSION_ID}", "page": f"/?mission={MISSION_ID}"},
}


class MissionSummary(BaseModel):
    """A mission without its document."""

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    id: str = Field(description="Names the mission.")
    name: str = Field(description="What people call it.")
    version: int = Field(description="Number of its newest version; each save makes one.")
    dem_id: str | None = Field(description="The DEM here that its ground is, by digest; null where it is not here.")
    ground: str | None = Field(description="Name of that DEM's file; null before a ground was chosen.")
    anchors: int = Field(description="Number of its anchors.")
    created_at: datetime = Field(description="When it was kept first.")
    saved_at: datetime = Field(description="When it was saved last.")
    saved_by: str | None = Field(description="By whom, when they said so.")
    links: dict[str, str] = Field(description="Paths of what belongs to it; page opens it in the planner.")

    @classmethod
    def of(cls, mission: MissionRecord) -> Self:
        """The mission of a record."""
        return cls.model_validate(_summary(mission))


class MissionOut(MissionSummary):
    """A version of a mission, with its document."""

    version_name: str | None = Field(description="What people call this version; it is kept for good then.")
    told: list[str] = Field(description="What to know of how it was opened, in sentences.")
    files: list[LayerLink] = Field(description="What it can be downloaded as.")
    mission: MissionIn

    @classmethod
    def told_of(cls, mission: MissionRecord, version: VersionRecord, told: list[str]) -> str:
        """JSON of all but the document."""
        own = {
            **_summary(mission),
            "version": version.version,
            "saved_at": _moment(version.saved_at_s),
            "saved_by": version.saved_by,
            "version_name": version.name,
            "told": told,
            "files": [
                LayerLink(
                    name=file.name,
                    href=rooted(f"/missions/{mission.id}/files/{file.name}"),
                    media_type=file.media_type,
                    description=file.description,
                )
                for file in MISSION_FILES.values()
            ],
        }
        return cls.model_construct(None, **own).model_dump_json(exclude={"mission"}, warnings=False)


class MissionList(Page):
    """One page of missions, last saved first."""

    missions: list[MissionSummary]


class VersionOut(BaseModel):
    """A version of a mission, without its document."""

    version: int = Field(description="Number of the version.")
    name: str | None = Field(description="What people call it; it is kept for good then.")
    saved_at: datetime = Field(description="When it was saved.")
    saved_by: str | None = Field(description="By whom, when they said so.")
    links: dict[str, str] = Field(description="Paths of what belongs to it.")

    @classmethod
    def of(cls, mission_id: str, version: VersionRecord) -> Self:
        """The version of a record."""
        path = rooted(f"/missions/{mission_id}/versions/{version.version}")
        return cls(
            version=version.version,
            name=version.name,
            saved_at=_moment(version.saved_at_s),
            saved_by=version.saved_by,
            links={"self": path, "restore": f"{path}/restore"},
        )


class VersionList(Page):
    """One page of a mission's versions, newest first."""

    versions: list[VersionOut]


VersionName = Annotated[PlainName, Field(min_length=1, max_length=120)]


class VersionNameIn(StrictModel):
    """What a version is to be called."""

    # FastAPI reads it itself, and wants it made
    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "as briefed"}]}, defer_build=False)

    name: VersionName | None = Field(description="The name; null takes it away.")


def _moment(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)


def _summary(mission: MissionRecord) -> dict[str, object]:
    return {
        "id": mission.id,
        "name": mission.name,
        "version": mission.version,
        "dem_id": mission.dem_id,
        "ground": mission.ground,
        "anchors": mission.anchors,
        "created_at": _moment(mission.created_at_s),
        "saved_at": _moment(mission.saved_at_s),
        "saved_by": mission.saved_by,
        "links": {
            "self": rooted(f"/missions/{mission.id}"),
            "versions": rooted(f"/missions/{mission.id}/versions"),
            "page": rooted(f"/?mission={mission.id}"),
        },
    }
