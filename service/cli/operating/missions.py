"""``sightline missions``: the planner's missions in the data folder, listed, shown, out and in as files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from ..asking.options import option
from ..output import facts_table, print_json, print_notes, print_tables
from .store import AsJson, DataFolder

if TYPE_CHECKING:
    from service.missions.shelf import MissionRecord, MissionShelf, VersionRecord
    from terrain import ElevationGrid

__all__ = ["missions"]

MOST_SHOWN = 1_000_000
Id = Annotated[
    str, Parameter(name="ID", allow_leading_hyphen=False, help="As `sightline missions list` tells it, or its start.")
]
Version = Annotated[int | None, option("Number of a version. (default the newest)", "N")]

missions = App(
    name="missions", help="List, show, export, import, delete and restore missions; a service may be running meanwhile."
)


@missions.command(name="list")
def list_missions(*, data: DataFolder = None, as_json: AsJson = False) -> None:
    """List the missions, last saved first."""
    with _shelf(data) as (shelf, _):
        found, _total = shelf.missions(MOST_SHOWN, 0)
    if as_json:
        print_json({"missions": [_told(one) for one in found]})
    elif found:
        print_tables(*(facts_table(one.name, _facts(one)) for one in found))
    else:
        print("There are no missions; the planner keeps one as soon as a ground is chosen.")


@missions.command
def show(id: Id, /, *, data: DataFolder = None, as_json: AsJson = False) -> None:
    """Show a mission and its versions."""
    with _shelf(data) as (shelf, _):
        mission = _named(shelf, id)
        versions, _total = shelf.versions(mission.id, MOST_SHOWN, 0)
    if as_json:
        print_json({**_told(mission), "versions": [_told_version(one) for one in versions]})
        return
    told = [(f"version {one.version}", _saved(one.saved_at_s, one.saved_by, one.name)) for one in versions]
    print_tables(facts_table(mission.name, [*_facts(mission), *told]))


@missions.command
def export(
    id: Id,
    file: Annotated[
        Path,
        Parameter(
            name="FILE",
            allow_leading_hyphen=False,
            help="Where to; its ending says as what: .json, .zip (with the DEM), .csv, .geojson, .kml, .kmz, .gpx, "
            ".plan.",
        ),
    ],
    /,
    *,
    version: Version = None,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Write a mission as a file, in place of one that is there."""
    from service.errors import RequestError
    from service.missions.document import MissionIn
    from service.missions.files import MISSION_FILES

    names = {Path(name).suffix: name for name in MISSION_FILES if name != "anchors.json"}
    if file.suffix.lower() not in names:
        raise RequestError(f"FILE ends in one of {', '.join(names)}, and {file.name!r} does not.")
    with _shelf(data) as (shelf, root):
        mission, told, document = shelf.document(_named(shelf, id).id, version)
        grid = None if mission.dem_id is None else _grid(root, mission.dem_id)
    made = file.with_name(f".{file.name}.part")
    try:
        MISSION_FILES[names[file.suffix.lower()]].save(MissionIn.model_validate_json(document), grid, made)
        made.replace(file)
    finally:
        made.unlink(missing_ok=True)
    if as_json:
        print_json({**_told(mission), "version": told.version, "file": str(file), "bytes": file.stat().st_size})
    else:
        print(f"Version {told.version} of {mission.name} is in {file}.")


@missions.command(name="import")
def import_mission(
    file: Annotated[
        Path, Parameter(name="FILE", allow_leading_hyphen=False, help="What export or the planner wrote: .json or .zip")
    ],
    /,
    *,
    by: Annotated[str | None, option("Who saves it.", "NAME")] = None,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Keep a mission out of a file as a new one. A DEM in its zip is left to the service: upload it there."""
    from tempfile import TemporaryDirectory
    from zipfile import is_zipfile

    from service.errors import NotValidError, RequestError
    from service.jobs.channel import model_of
    from service.missions.bundle import sheet_of, unpack
    from service.missions.document import MissionIn
    from service.settings import Settings

    settings = Settings()
    with TemporaryDirectory() as folder:
        limits = {"max_mission_bytes": settings.max_mission_bytes, "max_dem_bytes": settings.max_upload_bytes}
        try:
            packed = is_zipfile(file)
            text, dem = unpack(file, Path(folder) / "dem", **limits) if packed else (file.read_bytes(), None)
            sheet = sheet_of(model_of(MissionIn, text, lambda _: None))
        except FileNotFoundError as error:
            raise RequestError(f"There is no file {str(file)!r}.") from error
        except NotValidError as error:
            raise RequestError(f"The file {file.name} is no mission: {error}") from error
    with _shelf(data, may_be_new=True) as (shelf, _):
        mission = shelf.add(sheet, by)
    if as_json:
        print_json(_told(mission))
        return
    print(f"{mission.name} is kept as {mission.id}.")
    if dem is not None and mission.dem_id is None:
        print_notes(["Its ground came along and is not here: open the file in the planner, or upload the DEM."])


@missions.command
def delete(id: Id, /, *, data: DataFolder = None, as_json: AsJson = False) -> None:
    """Delete a mission with all its versions, for good."""
    with _shelf(data) as (shelf, _):
        mission = _named(shelf, id)
        shelf.remove(mission.id)
    if as_json:
        print_json({"deleted": _told(mission)})
    else:
        print(f"{mission.name} is gone, with its {mission.version} versions.")


@missions.command
def restore(
    id: Id,
    version: Annotated[int, Parameter(name="VERSION", help="Number of the version, as `show` tells it.")],
    /,
    *,
    by: Annotated[str | None, option("Who goes back to it.", "NAME")] = None,
    data: DataFolder = None,
    as_json: AsJson = False,
) -> None:
    """Save what a mission was at a version as its newest; nothing in between is lost."""
    from service.missions.bundle import sheet_of
    from service.missions.document import MissionIn

    with _shelf(data) as (shelf, _):
        mission, _told_then, document = shelf.document(_named(shelf, id).id, version)
        sheet = sheet_of(MissionIn.model_validate_json(document))
        saved = shelf.save(mission.id, sheet, str(mission.version), by)
    if as_json:
        print_json(_told(saved))
    else:
        print(f"{saved.name} is as it was at version {version}, and that is version {saved.version} now.")


@contextmanager
def _shelf(data: Path | None, *, may_be_new: bool = False) -> Iterator[tuple[MissionShelf, Path]]:
    """The missions of a data folder, and the folder. Raises DataFolderError, RequestError."""
    from service.errors import RequestError
    from service.jobs.marker import claimed
    from service.jobs.store import Store
    from service.jobs.store_place import StorePlace
    from service.missions.shelf import MissionShelf
    from service.settings import Settings

    settings = Settings() if data is None else Settings(data_folder=data)
    if not may_be_new and not settings.data_folder.exists():
        raise RequestError(f"There is no data folder {str(settings.data_folder)!r}.")
    root = claimed(settings.data_folder)
    store = Store(StorePlace.of(settings, root).open())
    try:
        yield MissionShelf(store.transaction, settings.max_missions, settings.max_mission_versions), root
    finally:
        store.close()


def _named(shelf: MissionShelf, id: str) -> MissionRecord:
    """The one mission whose id begins so. Raises NotFoundError, RequestError."""
    from service.errors import RequestError

    found, _ = shelf.missions(MOST_SHOWN, 0)
    same = [one for one in found if one.id.startswith(id)]
    if len(same) > 1:
        raise RequestError(f"{len(same)} missions have ids that begin with {id!r}; write more of it.")
    return same[0] if same else shelf.mission(id)


def _grid(root: Path, dem_id: str) -> ElevationGrid:
    from service.jobs.kept_files import load_grid

    return load_grid(root / "dems" / dem_id)


def _saved(at_s: float, by: str | None, name: str | None = None) -> str:
    when = datetime.fromtimestamp(at_s, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    return ", ".join(one for one in (when, by, name) if one)


def _facts(mission: MissionRecord) -> list[tuple[str, str]]:
    ground = "none" if mission.ground is None else mission.ground + ("" if mission.dem_id else " (not here)")
    return [
        ("id", mission.id),
        ("ground", ground),
        ("anchors", str(mission.anchors)),
        ("versions", str(mission.version)),
        ("saved", _saved(mission.saved_at_s, mission.saved_by)),
    ]


def _told(mission: MissionRecord) -> dict[str, object]:
    return {
        "id": mission.id,
        "name": mission.name,
        "version": mission.version,
        "dem_id": mission.dem_id,
        "ground": mission.ground,
        "anchors": mission.anchors,
        "saved_at": datetime.fromtimestamp(mission.saved_at_s, UTC).isoformat(),
        "saved_by": mission.saved_by,
    }


def _told_version(version: VersionRecord) -> dict[str, object]:
    saved_at = datetime.fromtimestamp(version.saved_at_s, UTC).isoformat()
    return {"version": version.version, "name": version.name, "saved_at": saved_at, "saved_by": version.saved_by}
