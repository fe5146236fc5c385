"""Missions: kept with their versions, told when somebody else saved since, shared as files."""

from __future__ import annotations

from typing import Annotated

from fastapi import Header, Path, Query, Request, Response
from pydantic import Field

from service.errors import NoPreconditionError
from service.jobs.channel import BodyArguments
from service.jobs.mission_tasks import sheet_in
from service.jobs.records import Place
from service.missions.document import MissionIn, PlainName
from service.missions.shelf import MissionRecord, Sheet, VersionRecord

from ..bodies import json_body, receive
from ..context import Service, ServiceDep
from ..guard.body_limit import too_large
from ..guard.routing import Router
from ..lists import TurnDep
from ..meta import KNOWN, LOCATION, body_of, problem_responses
from ..problems import is_json
from .answers import MissionList, MissionOut, MissionSummary, VersionList, VersionName, VersionNameIn, VersionOut
from .files import opened_mission

__all__ = ["router"]

router = Router(prefix="/missions", tags=["Missions"])
JSON = "application/json"
ETAG = {"ETag": {"description": "The version, for If-Match and If-None-Match.", "schema": {"type": "string"}}}
By = Annotated[
    Annotated[PlainName, Field(max_length=80)] | None,
    Query(description="Who saves: told to whoever saves against it."),
]
Named = Annotated[VersionName | None, Query(description="Name of the version, with which it is kept for good.")]
IfMatch = Annotated[
    str | None,
    Header(description="The version that yours builds on, as its ETag told it; `*` overwrites whatever is there."),
]
Version = Annotated[int, Path(ge=1, le=2**53, description="Number of the version.")]
FILE_BODY = {
    "requestBody": {
        "required": True,
        "content": {
            JSON: {"schema": {"$ref": f"#/components/schemas/{MissionIn.__name__}"}},
            "application/zip": {"schema": {"type": "string", "format": "binary"}},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "properties": {"file": {"type": "string", "format": "binary"}},
                    "required": ["file"],
                }
            },
        },
    }
}


@router.post(
    "",
    status_code=201,
    summary="Keep a new mission",
    response_model=None,
    responses={
        201: {"description": "It is kept.", "headers": {**LOCATION, **ETAG}, "model": MissionOut},
        **problem_responses(400, 409, 413, 415, 422, 503, 507),
    },
    openapi_extra=FILE_BODY,
)
async def add_mission(request: Request, service: ServiceDep, by: By = None, version_name: Named = None) -> Response:
    """A mission as JSON, or a file that Sightline wrote: `mission.json`, or `mission.zip` with the DEM in it.

    Its ground is found by the digest of the DEM; one that the service does not have is taken out of the zip. Without
    it the mission is kept all the same, `dem_id` is null, and it stands on its ground once that is uploaded.
    """
    told: list[str] = []
    if is_json(request):
        sheet = await _read(request, service)
    else:
        limit = service.settings.max_upload_bytes
        async with receive(request, service, limit, "max_upload_bytes", "mission") as upload:
            sheet, told = await opened_mission(service, upload)
    mission = await service.supervisor.in_store(service.missions.add, sheet, by, version_name)
    version = VersionRecord(mission.version, version_name, mission.saved_at_s, by)
    answer = _answer(mission, version, sheet.document, 201, told)
    answer.headers["Location"] = f"/missions/{mission.id}"
    return answer


@router.get("", summary="List missions", responses=problem_responses(422))
async def list_missions(service: ServiceDep, turn: TurnDep) -> MissionList:
    """Missions without their documents, last saved first. `next` leads to the page after."""
    asked = (turn.limit + 1, turn.offset, turn.after)
    missions, total = await service.look_up(service.missions.missions, *asked)
    told = [MissionSummary.of(one) for one in missions[: turn.limit]]
    following = turn.cursor([one.place for one in missions])
    return MissionList(missions=told, total=total, limit=turn.limit, offset=turn.offset, next=following)


@router.get(
    "/{mission_id}",
    summary="Open a mission",
    response_model=None,
    responses={
        200: {"description": "The newest version.", "headers": ETAG, "model": MissionOut},
        304: KNOWN,
        **problem_responses(404),
    },
)
async def get_mission(request: Request, mission_id: str, service: ServiceDep) -> Response:
    """The newest version with its document."""
    mission, version, document = await service.supervisor.in_store(service.missions.document, mission_id)
    if f'"{mission.version}"' in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers={"ETag": f'"{mission.version}"'})
    return _answer(mission, version, document)


@router.put(
    "/{mission_id}",
    summary="Save a mission",
    responses={
        200: {"description": "It is saved; the version is in the ETag.", "headers": ETAG},
        **problem_responses(400, 404, 412, 413, 415, 422, 428, 503, 507),
    },
    openapi_extra=body_of(MissionIn),
)
async def save_mission(
    mission_id: str,
    request: Request,
    response: Response,
    service: ServiceDep,
    if_match: IfMatch = None,
    by: By = None,
    version_name: Named = None,
) -> MissionSummary:
    """Make a new version, unless it is the same as the newest. If somebody else saved since, 412 says who and when."""
    builds_on = _builds_on(if_match)
    sheet = await _read(request, service)
    saved = await service.supervisor.in_store(service.missions.save, mission_id, sheet, builds_on, by, version_name)
    return _told(saved, response)


@router.delete("/{mission_id}", status_code=204, summary="Delete a mission", responses=problem_responses(404, 412))
async def delete_mission(mission_id: str, service: ServiceDep, if_match: IfMatch = None) -> None:
    """With all its versions, for good. Its ground and what was calculated on it stay."""
    builds_on = "*" if if_match is None else _builds_on(if_match)
    await service.supervisor.in_store(service.missions.remove, mission_id, builds_on)


@router.get("/{mission_id}/versions", summary="List a mission's versions", responses=problem_responses(404, 422))
async def list_versions(mission_id: str, service: ServiceDep, turn: TurnDep) -> VersionList:
    """Newest first. Those with names stay for good; of the others, older ones make room for newer ones."""
    asked = (mission_id, turn.limit + 1, turn.offset, turn.after)
    versions, total = await service.look_up(service.missions.versions, *asked)
    told = [VersionOut.of(mission_id, one) for one in versions[: turn.limit]]
    following = turn.cursor([Place(one.version, mission_id) for one in versions])
    return VersionList(versions=told, total=total, limit=turn.limit, offset=turn.offset, next=following)


@router.get(
    "/{mission_id}/versions/{version}",
    summary="Open a version",
    response_model=None,
    responses={200: {"description": "As it was then.", "model": MissionOut}, **problem_responses(404, 422)},
)
async def get_version(mission_id: str, version: Version, service: ServiceDep) -> Response:
    """The mission as it was saved then."""
    return _answer(*await service.supervisor.in_store(service.missions.document, mission_id, version))


@router.put(
    "/{mission_id}/versions/{version}/name", summary="Name a version", responses=problem_responses(400, 404, 422)
)
async def name_version(mission_id: str, version: Version, named: VersionNameIn, service: ServiceDep) -> VersionOut:
    """With a name it is kept for good; null takes the name away."""
    found = await service.supervisor.in_store(service.missions.name_version, mission_id, version, named.name)
    return VersionOut.of(mission_id, found)


@router.post(
    "/{mission_id}/versions/{version}/restore",
    summary="Go back to a version",
    responses={
        200: {"description": "It is the newest again.", "headers": ETAG},
        **problem_responses(404, 412, 422, 428),
    },
)
async def restore_version(
    mission_id: str, version: Version, response: Response, service: ServiceDep, if_match: IfMatch = None, by: By = None
) -> MissionSummary:
    """Save what the mission was then as its newest version; nothing in between is lost."""
    builds_on = _builds_on(if_match)
    _, _, document = await service.supervisor.in_store(service.missions.document, mission_id, version)
    sheet = sheet_in(await service.checks.ask("read-mission", BodyArguments(body=document)))
    saved = await service.supervisor.in_store(service.missions.save, mission_id, sheet, builds_on, by)
    return _told(saved, response)


async def _read(request: Request, service: Service) -> Sheet:
    limit = service.settings.max_mission_bytes
    body = await json_body(request)
    if len(body.encode()) > limit:
        raise too_large(limit, "max_mission_bytes")
    return sheet_in(await service.checks.ask("read-mission", BodyArguments(body=body)))


def _builds_on(if_match: str | None) -> str:
    if if_match is None:
        raise NoPreconditionError(
            "Say in the header If-Match which version yours builds on, as its ETag told it, so that nobody's work is "
            "lost; 'If-Match: *' overwrites whatever is there."
        )
    return if_match.strip().removeprefix("W/").strip('"')


def _told(saved: MissionRecord, response: Response) -> MissionSummary:
    response.headers["ETag"] = f'"{saved.version}"'
    return MissionSummary.of(saved)


def _answer(
    mission: MissionRecord, version: VersionRecord, document: str, status: int = 200, told: list[str] | None = None
) -> Response:
    """The mission with its document, which is JSON already."""
    summary = MissionOut.told_of(mission, version, told or []).removesuffix("}")
    return Response(f'{summary},"mission":{document}}}', status, {"ETag": f'"{version.version}"'}, JSON)
