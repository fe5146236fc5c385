"""Missions as files: opened with the DEM that came along, and downloaded."""

from __future__ import annotations

import re
import uuid
from pathlib import Path
from typing import Annotated, cast

import orjson
from fastapi import Query, Request, Response
from starlette.background import BackgroundTask

from service.errors import NotFoundError
from service.jobs.channel import BodyArguments, ReadDemArguments
from service.jobs.mission_tasks import MissionFileArguments, OpenedMission, PlacesArguments, sheet_in
from service.missions.files import MISSION_FILES
from service.missions.importing import ImportOut
from service.missions.shelf import Sheet

from ..bodies import Upload, receive
from ..context import Service, ServiceDep
from ..dem_keeping import dem_id_of, keep_dem
from ..guard.routing import Router
from ..jobs import RangedFile
from ..meta import FILE_BODY, PART, problem_responses

__all__ = ["imports", "opened_mission", "router"]

router = Router(prefix="/missions", tags=["Missions"])
imports = Router(prefix="/imports", tags=["Missions"])
# of a file, on one system or another
NOT_IN_NAMES = re.compile(r'[\x00-\x1f\x7f/\\:*?"<>|]+')
Version = Annotated[int, Query(ge=1, le=2**53, description="Number of a version.")]


@router.get(
    "/{mission_id}/files/{name}",
    summary="Download a mission",
    response_class=RangedFile,
    responses={200: {"description": "The file."}, 206: PART, **problem_responses(404, 409, 416, 422, 503, 507)},
)
async def get_file(mission_id: str, name: str, service: ServiceDep, version: Version | None = None) -> Response:
    """One of the files that its links name, of the newest version or of another; saved as NAME OF THE MISSION.name."""
    file = MISSION_FILES.get(name)
    if file is None:
        raise NotFoundError("file", name, f"a mission has {', '.join(MISSION_FILES)}")
    mission, _, document = await service.supervisor.in_store(service.missions.document, mission_id, version)
    token = uuid.uuid4().hex
    arguments = MissionFileArguments(file=name, document=document, dem_id=mission.dem_id)
    await service.supervisor.ask("write-mission-file", arguments, token)
    folder = service.folder.work(token)
    gone = BackgroundTask(service.supervisor.in_store, service.folder.remove, folder)
    filename = f"{NOT_IN_NAMES.sub('_', mission.name).strip(' .')[:80] or 'mission'}.{file.name}"
    return RangedFile(folder / file.name, media_type=file.media_type, filename=filename, background=gone)


@imports.post(
    "",
    summary="Read places from a file",
    response_model=None,
    responses={
        200: {"description": "The places.", "model": ImportOut},
        **problem_responses(400, 404, 409, 413, 422, 503, 507),
    },
    openapi_extra=FILE_BODY,
)
async def read_places(
    request: Request,
    service: ServiceDep,
    dem_id: Annotated[str, Query(max_length=80, description="The DEM that the places are brought onto.")],
    filename: Annotated[
        str | None, Query(max_length=255, description="Name of the file, when the body is the bare file.")
    ] = None,
) -> Response:
    """KML, KMZ, GPX, QGroundControl's .plan, GeoJSON, CSV or JSON of anchors, as its suffix says; nothing is kept.

    Altitudes come back in the DEM's vertical datum: KML's count from EGM96, GPX's and plans' from mean sea level, those
    above the ground stay so. What was not understood, and what lies outside, is told.
    """
    limit = service.settings.max_places_bytes
    async with receive(request, service, limit, "max_places_bytes", filename) as upload:
        arguments = PlacesArguments(path=str(upload.path), dem_id=dem_id)
        found = await service.checks.ask("read-places", arguments, big=True)
    return Response(str(found["json"]), media_type="application/json")


async def opened_mission(service: Service, upload: Upload) -> tuple[Sheet, list[str]]:
    """The mission in a file; its DEM is kept, when it came along and is not here."""
    token = uuid.uuid4().hex
    try:
        arguments = BodyArguments(path=str(upload.path))
        opened = cast(OpenedMission, await service.checks.ask("open-mission", arguments, token, big=True))
        sheet = sheet_in(opened)
        if opened["dem_path"] is None or sheet.dem_sha256 is None:
            return sheet, []
        here = await service.supervisor.in_store(service.missions.dem_with_digest, sheet.dem_sha256)
        if here is not None:
            return sheet, [f"The ground was here already, as DEM {here}."]
        path = Path(opened["dem_path"])
        dem_id = dem_id_of("mission", upload.sha256)
        dem, _ = await keep_dem(
            service, dem_id, sheet.ground or path.name, "read-dem", ReadDemArguments(path=str(path), options={}), None
        )
        if dem.summary["sha256"] == sheet.dem_sha256:
            return sheet, [f"The ground came along, and is here now as DEM {dem.id}."]
        digest = str(dem.summary["sha256"])
        document = orjson.loads(sheet.document)
        document["ground"]["sha256"] = digest
        asked = BodyArguments(body=orjson.dumps(document).decode())
        told = f"The DEM that came along has the digest {digest}, which is not the one that the mission was made on."
        return sheet_in(await service.checks.ask("read-mission", asked)), [told]
    finally:
        await service.supervisor.in_store(service.folder.remove, service.folder.work(token))
