"""The files that a mission can be downloaded as."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from service.errors import NotReadyError
from service.files.layer import GEOJSON, JSON
from service.missions.bundle import write_bundle
from service.missions.document import MissionIn
from service.missions.exports import (
    write_csv,
    write_geojson,
    write_gpx,
    write_kml_of,
    write_kmz,
    write_plan,
    write_rows,
)
from terrain import ElevationGrid

__all__ = ["MISSION_FILES", "MissionFile"]

ZIP, CSV = "application/zip", "text/csv; charset=utf-8"
KML, KMZ = "application/vnd.google-earth.kml+xml", "application/vnd.google-earth.kmz"
GPX = "application/gpx+xml"
Writer = Callable[[MissionIn, ElevationGrid, Path], None]


@dataclass(frozen=True, slots=True)
class MissionFile:
    """A file of a mission: its name, media type, a sentence, and what writes it.

    write: told the mission, its grid and where to; on_its_own: writes it without a grid where there is none.
    """

    name: str
    media_type: str
    description: str
    write: Writer | None = None
    on_its_own: Callable[[MissionIn, ElevationGrid | None, Path], None] | None = None

    def save(self, mission: MissionIn, grid: ElevationGrid | None, path: Path) -> None:
        """Write the file. Raises NotReadyError when it needs a ground that is not there, and what the writer raises."""
        if self.on_its_own is not None:
            self.on_its_own(mission, grid, path)
            return
        if grid is None:
            what = "has no ground yet" if mission.ground is None else f"stands on {mission.ground.name[:80]!r}"
            raise NotReadyError(
                f"{self.name} needs the mission's ground, and the mission {what}"
                + ("." if mission.ground is None else ", which is not here; upload it first.")
            )
        assert self.write is not None, "a file is written in one of two ways"
        self.write(mission, grid, path)


def _write_json(mission: MissionIn, grid: ElevationGrid | None, path: Path) -> None:
    path.write_text(mission.model_dump_json(indent=1), encoding="utf-8")


def _write_zip(mission: MissionIn, grid: ElevationGrid | None, path: Path) -> None:
    write_bundle(mission.model_dump_json(), grid, path)


FILES = (
    MissionFile(
        "mission.json",
        JSON,
        "All decisions, with the digest of the DEM that they were made on.",
        on_its_own=_write_json,
    ),
    MissionFile("mission.zip", ZIP, "The same and the DEM, for services that do not have it.", on_its_own=_write_zip),
    MissionFile("anchors.json", JSON, "Every anchor in every frame: metres, degrees, four heights.", write_rows),
    MissionFile("anchors.csv", CSV, "A row per anchor, as --anchors and the planner read it.", write_csv),
    MissionFile("mission.geojson", GEOJSON, "Anchors, route and areas, in degrees.", write_geojson),
    MissionFile("mission.kml", KML, "Anchors at their altitude above EGM96, route and areas. On Earth.", write_kml_of),
    MissionFile("mission.kmz", KMZ, "The same, packed.", write_kmz),
    MissionFile("mission.gpx", GPX, "Anchors as way-points above mean sea level, and the route.", write_gpx),
    MissionFile("anchors.plan", JSON, "A way-point for each anchor, for QGroundControl.", write_plan),
)
MISSION_FILES: Mapping[str, MissionFile] = MappingProxyType({file.name: file for file in FILES})
