"""A mission as one file: its JSON, or a zip that holds its DEM as well, out and in.

A zip of somebody else is read with bounds: few members, none larger than it may be, whatever its directory says.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from service.errors import LimitError, RequestError
from service.files.zips import member_blocks, opened_zip
from service.missions.document import MissionIn
from service.missions.shelf import Sheet
from terrain import ElevationGrid, write_npz

__all__ = ["DEM_STEM", "MISSION_FILE", "sheet_of", "unpack", "write_bundle"]

MISSION_FILE = "mission.json"
DEM_STEM = "dem"
MOST_MEMBERS = 16
LONGEST_SUFFIX = 8
# a zip's entries carry a time; one for all makes files of equal missions equal
ZIP_TIME = (2020, 1, 1, 0, 0, 0)


def sheet_of(mission: MissionIn) -> Sheet:
    """What is kept of a mission: its document, defaults filled in, and what lists tell of it."""
    ground = mission.ground
    return Sheet(
        document=mission.model_dump_json(),
        name=mission.name,
        anchors=len(mission.anchors),
        dem_sha256=None if ground is None else ground.sha256,
        ground=None if ground is None else ground.name,
    )


def write_bundle(document: str, grid: ElevationGrid | None, path: Path) -> None:
    """Write a zip of the mission and of its DEM as .npz, whose digest is the same when it is read. Raises OSError."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        text = json.dumps(json.loads(document), indent=1, ensure_ascii=False)
        archive.writestr(zipfile.ZipInfo(MISSION_FILE, ZIP_TIME), text, zipfile.ZIP_DEFLATED)
        if grid is not None:
            packed = path.with_name(f"{DEM_STEM}.npz")
            write_npz(grid, packed)
            archive.write(packed, packed.name, zipfile.ZIP_STORED)  # it is compressed already
            packed.unlink()


def unpack(path: Path, folder: Path, *, max_mission_bytes: int, max_dem_bytes: int) -> tuple[bytes, Path | None]:
    """(the mission's JSON, where its DEM's file lies now) of a zip; the DEM goes into ``folder``, which is made.

    Raises RequestError for what is no zip of a mission, LimitError for members that are too large.
    """
    damaged = f"{path.name} is a damaged zip, or one that is packed in a way not understood."
    with opened_zip(path, damaged) as archive:
        members = [member for member in archive.infolist() if not member.filename.endswith("/")]
        missions = [member for member in members if member.filename == MISSION_FILE]
        if not missions:
            raise RequestError(f"{path.name} holds no {MISSION_FILE}, so it is no mission of Sightline.")
        dems = [member for member in members if _is_dem(Path(member.filename))]
        others = [member.filename for member in members if member not in (*missions, *dems)]
        if len(members) > MOST_MEMBERS or len(missions) > 1 or len(dems) > 1 or others:
            odd = others[0][:80] if others else f"{len(members)} files"
            raise RequestError(f"{path.name} holds {odd!r}; a mission's zip holds {MISSION_FILE} and one DEM alone.")
        mission = member_blocks(archive, missions[0], damaged)
        text = b"".join(_bounded(mission, missions[0].filename, max_mission_bytes, "max_mission_bytes"))
        if not dems:
            return text, None
        folder.mkdir(parents=True)
        target = folder / Path(dems[0].filename).name
        with target.open("wb") as file:
            dem = member_blocks(archive, dems[0], damaged)
            file.writelines(_bounded(dem, dems[0].filename, max_dem_bytes, "max_upload_bytes"))
        return text, target


def _is_dem(path: Path) -> bool:
    return path.stem == DEM_STEM and len(path.suffix) <= LONGEST_SUFFIX


def _bounded(blocks: Iterable[bytes], name: str, max_bytes: int, limit_name: str) -> Iterator[bytes]:
    total = 0
    for block in blocks:
        total += len(block)
        if total > max_bytes:
            raise LimitError(
                f"{name[:80]} unpacks to more than the limit of {max_bytes:,} bytes",
                limit_name=limit_name,
                limit=max_bytes,
            )
        yield block
