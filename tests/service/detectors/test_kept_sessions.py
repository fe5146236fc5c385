"""Sessions on disk: bounded, tolerant of what a crash leaves, and never more than a detector."""

from __future__ import annotations

import logging
import os
import pickle
from pathlib import Path
from typing import Any

import pytest

from service.errors import GoneError, NotFoundError
from service.live.keeping import PART_EPOCHS, Part, SessionFolder
from service.live.registry import Detectors
from service.live.request import ANCHORS, RANGES, DetectorIn, EpochIn
from service.live.snapshots import SnapshotError, freeze, thaw
from service.settings import Settings
from terrain import ElevationGrid


def registry(folder: Path) -> Detectors:
    folder.mkdir(exist_ok=True)
    return Detectors(Settings(), folder=folder)


def nothing(dem_id: str) -> ElevationGrid:
    raise NotFoundError("DEM", dem_id)


def epoch(number: int) -> EpochIn:
    return EpochIn.model_validate({"time_s": float(number), "sequence": number, "ranges": RANGES})


async def fed(detectors: Detectors, count: int, **asked: Any) -> str:
    session = detectors.open(DetectorIn.model_validate({"anchors": ANCHORS, **asked}))
    for number in range(count):
        await session.answer_in_turn(epoch(number))
    return session.id


def anew(folder: Path) -> Detectors:
    """What a service that starts again makes of the folder."""
    detectors = registry(folder)
    detectors.restore(nothing)
    return detectors


@pytest.mark.anyio
async def test_a_session_takes_two_parts_of_disk_at_most(tmp_path: Path) -> None:
    id = await fed(registry(tmp_path), 3 * PART_EPOCHS + 5)
    kept = sorted(path.name for path in (tmp_path / id).iterdir())
    assert kept == ["2.epochs", "2.memory", "3.epochs", "3.memory", "session.json"]
    again = anew(tmp_path).get(id)
    assert again.memory.detector.state.epochs == 3 * PART_EPOCHS + 5


@pytest.mark.anyio
async def test_a_line_that_was_cut_off_is_left_out(tmp_path: Path) -> None:
    id = await fed(registry(tmp_path), 3)
    log = tmp_path / id / "0.epochs"
    os.truncate(log, log.stat().st_size - 7)
    again = anew(tmp_path).get(id)
    assert again.description()["acknowledged"] == {"time_s": 1.0, "sequence": 1}


@pytest.mark.anyio
@pytest.mark.parametrize("spoil", [lambda data: b"x" * 32 + data[32:], lambda data: data[:200], lambda data: b""])
async def test_memory_of_another_release_is_made_anew_from_the_epochs(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, spoil: Any
) -> None:
    id = await fed(registry(tmp_path), 20)
    memory = tmp_path / id / "0.memory"
    memory.write_bytes(spoil(memory.read_bytes()))
    with caplog.at_level(logging.WARNING):
        again = anew(tmp_path).get(id)
    assert again.memory.detector.state.epochs == 20
    assert "made anew from the epochs that are kept" in caplog.text


@pytest.mark.anyio
async def test_a_session_whose_map_is_gone_says_so(tmp_path: Path) -> None:
    id = await fed(registry(tmp_path), 1)
    facts = tmp_path / id / "session.json"
    facts.write_text(facts.read_text().replace('"anchors"', '"dem_id": "d1", "anchors"', 1))
    with pytest.raises(GoneError, match="could not be gone on with"):
        anew(tmp_path).get(id)


def test_what_is_no_session_stays_where_it_is(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "thesis.txt").write_text("mine")
    (tmp_path / "file").write_text("mine too")
    assert len(anew(tmp_path)) == 0
    assert (tmp_path / "folder" / "thesis.txt").read_text() == "mine"
    assert (tmp_path / "file").read_text() == "mine too"


@pytest.mark.anyio
async def test_a_disk_that_refuses_ends_the_keeping_and_not_the_session(tmp_path: Path) -> None:
    detectors = registry(tmp_path)
    session = detectors.open(DetectorIn.model_validate({"anchors": ANCHORS}))
    assert session.folder is not None
    session.folder.close()
    (tmp_path / session.id).rename(tmp_path / "away")
    session.folder._file = os.open(os.devnull, os.O_RDONLY)  # every write to it fails
    await session.answer_in_turn(epoch(0))
    await session.answer_in_turn(epoch(1))
    assert session.description()["kept"] is False
    assert session.memory.detector.state.epochs == 2


class Evil:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("made-by-a-snapshot",)


@pytest.mark.anyio
async def test_a_snapshot_calls_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    detectors = registry(tmp_path / "kept")
    memory = detectors.get(await fed(detectors, 3)).memory
    whole = freeze(memory)
    assert thaw(whole, None).detector.state.epochs == 3
    with pytest.raises(SnapshotError, match=r"has no posix\.mkdir"):
        thaw(whole[:32] + pickle.dumps(Evil()), None)
    assert not (tmp_path / "made-by-a-snapshot").exists()


@pytest.mark.anyio
async def test_a_session_that_cannot_be_gone_on_with_keeps_no_service_from_starting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = await fed(registry(tmp_path), 2), await fed(registry(tmp_path), 3)
    real = SessionFolder.parts

    def broken(folder: SessionFolder) -> tuple[Part, ...]:
        if folder._root.name == first:
            raise ZeroDivisionError
        return real(folder)

    monkeypatch.setattr(SessionFolder, "parts", broken)
    detectors = anew(tmp_path)
    with pytest.raises(GoneError, match="a fault of ours"):
        detectors.get(first)
    assert detectors.get(second).memory.detector.state.epochs == 3
    assert (tmp_path / first / "0.epochs").is_file()


@pytest.mark.anyio
async def test_a_calibration_is_applied_before_and_after(tmp_path: Path) -> None:
    detectors = registry(tmp_path)
    plain = detectors.get(await fed(detectors, 5))
    long = {"anchors": ANCHORS, "calibration": {"scale": 1.02, "offset_m": 0.4, "anchor_offsets_m": {"D2": 0.7}}}
    session = detectors.open(DetectorIn.model_validate(long))
    for number in range(5):
        ranges = [
            {**one, "range_m": 1.02 * one["range_m"] + (0.7 if one["anchor_id"] == "D2" else 0.4)} for one in RANGES
        ]
        await session.answer_in_turn(EpochIn.model_validate({"time_s": float(number), "ranges": ranges}))
    again = anew(tmp_path).get(session.id)
    for one in (session, again):
        assert one.memory.detector.state.position_m == pytest.approx(plain.memory.detector.state.position_m)
    told = await again.calibration("offset")
    assert told["of"] == "offset"
