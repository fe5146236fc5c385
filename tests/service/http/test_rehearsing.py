"""What a service compiles and loads before it takes work is a setting."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

import service.http.context
import service.jobs.worker
from service.http.app import create_app
from service.jobs.worker import rehearse
from service.products.registry import PRODUCTS
from service.settings import Rehearsal, Settings


@pytest.mark.parametrize(("what", "times"), [("everything", 1), ("maps", 0)])
def test_detectors_are_rehearsed_where_everything_is(
    what: Rehearsal, times: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rehearsed: list[None] = []
    monkeypatch.setattr(service.http.context, "rehearse", lambda: rehearsed.append(None))
    settings = Settings(data_folder=tmp_path / "data", workers=1, file_workers=1, spare_workers=0, rehearse=what)
    app = create_app(settings)

    async def start_and_stop() -> None:
        async with app.router.lifespan_context(app):
            assert not app.state.service.warm
            async with asyncio.timeout(60.0):
                while not app.state.service.warm:
                    await asyncio.sleep(0.01)

    asyncio.run(start_and_stop())
    assert len(rehearsed) == times


@pytest.mark.parametrize("what", ["everything", "maps"])
def test_workers_warm_up_what_the_setting_says(what: Rehearsal, monkeypatch: pytest.MonkeyPatch) -> None:
    warmed: list[tuple[str, object, bool]] = []
    monkeypatch.setattr(
        service.jobs.worker,
        "warm_up",
        lambda what, products, *, own_processes: warmed.append((what, products, own_processes)),
    )
    rehearse(what, PRODUCTS, first=False)
    assert warmed == [(what, PRODUCTS, False)]


def test_everything_is_rehearsed_unless_told_otherwise() -> None:
    assert Settings().rehearse == "everything"
