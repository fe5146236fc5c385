"""Zips that were damaged anywhere, or are packed in rare ways: what is in them, or one sentence."""

from __future__ import annotations

import random
import zipfile
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import pytest

from service.errors import LimitError, RequestError
from service.files.foreign.reading import read_foreign
from service.missions.bundle import MISSION_FILE, unpack

KML = b"<kml><Placemark><Point><coordinates>1,2</coordinates></Point></Placemark></kml>"
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)


def zipped(name: str, content: bytes, packing: int = zipfile.ZIP_DEFLATED) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", packing) as archive:
        archive.writestr(name, content)
    return packed.getvalue()


def opened(data: bytes, folder: Path) -> bytes:
    packed = folder / "mission.zip"
    packed.write_bytes(data)
    return unpack(packed, folder / "unpacked", max_mission_bytes=1000, max_dem_bytes=1000)[0]


def damaged(data: bytes, chance: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 3))):
        changed[chance.randrange(len(changed))] = chance.choice((0, 255, chance.randrange(256)))
    return bytes(changed[: chance.randrange(1, len(changed))] if chance.random() < 0.1 else changed)


@pytest.mark.parametrize("packing", PACKINGS)
def test_no_damage_is_a_fault(tmp_path: Path, packing: int) -> None:
    chance = random.Random(packing)
    kmz, mission = zipped("doc.kml", KML, packing), zipped(MISSION_FILE, b'{"name": "a"}', packing)
    for _ in range(500):
        with suppress(RequestError):
            read_foreign("a.kmz", damaged(kmz, chance))
        with suppress(RequestError, LimitError):
            opened(damaged(mission, chance), tmp_path)


def test_only_what_is_stored_or_deflated_is_unpacked(tmp_path: Path) -> None:
    for packing in PACKINGS[:2]:
        assert len(read_foreign("a.kmz", zipped("doc.kml", KML, packing)).features) == 1
        assert opened(zipped(MISSION_FILE, b"{}", packing), tmp_path) == b"{}"
    for packing in PACKINGS[2:]:
        with pytest.raises(RequestError, match="packed in a way that KMZ does not know"):
            read_foreign("a.kmz", zipped("doc.kml", KML, packing))
        with pytest.raises(RequestError, match="packed in a way not understood"):
            opened(zipped(MISSION_FILE, b"{}", packing), tmp_path)


def test_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    packed = tmp_path / "mission.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(MISSION_FILE, b"{}")
        archive.writestr(f"dem.{'x' * 300}", b"heights")
    with pytest.raises(RequestError, match=r"one DEM alone"):
        unpack(packed, tmp_path / "unpacked", max_mission_bytes=1000, max_dem_bytes=1000)
