"""Short tasks that worker processes do beside the jobs: requests are checked, layers and pictures drawn once."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path

from pydantic import JsonValue

from service.errors import NotFoundError
from service.settings import Settings

from .channel import DemArguments, LayerArguments, LevelArguments
from .folder import DataFolder, move_into_place
from .pool import Lane
from .supervisor import Supervisor
from .tile_tasks import TileLevelArguments, level_name

__all__ = ["Checks", "Drawings"]


class Checks:
    """Has requests checked; big ones never hold every process that others need."""

    def __init__(self, settings: Settings, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self._big_ones = asyncio.Semaphore(max(1, settings.file_workers - 1))

    async def ask(
        self, task: str, arguments: Mapping[str, object], token: str | None = None, *, big: bool = False
    ) -> Mapping[str, object]:
        """What the check tells. Raises as Supervisor.ask."""
        async with self._big_ones if big else nullcontext():
            return await self._supervisor.ask(task, arguments, token, Lane.CHECKS)


class Drawings:
    """Draws in worker processes and keeps what it drew beside what it was drawn from."""

    def __init__(self, folder: DataFolder, supervisor: Supervisor) -> None:
        self._folder = folder
        self._supervisor = supervisor
        self._under_way: dict[Path, asyncio.Task[None]] = {}

    async def layer(self, digest: str, name: str, summary: Mapping[str, JsonValue]) -> Path:
        """The file of a layer of a result, whose answer the store has as summary.

        Raises what Supervisor.ask raises, NotFoundError when the result was deleted.
        """
        path, gone = self._folder.layer(digest, name), NotFoundError("result", digest)
        arguments = LayerArguments(digest=digest, layer=name, summary=summary)
        return await self._drawn(path, "draw-layer", arguments, self._folder.result(digest), gone)

    async def hillshade(self, dem_id: str) -> Path:
        """The picture of a DEM that the store knows; raises the same when it was deleted."""
        path, source = self._folder.hillshade(dem_id), self._folder.dem(dem_id)
        return await self._drawn(
            path, "draw-hillshade", DemArguments(dem_id=dem_id), source, NotFoundError("DEM", dem_id)
        )

    async def level(self, dem_id: str, level: int) -> Path:
        """The heights of a DEM at a resolution level; raises the same when it was deleted."""
        path, source = self._folder.level(dem_id, level), self._folder.dem(dem_id)
        arguments = LevelArguments(dem_id=dem_id, level=level)
        return await self._drawn(path, "write-level", arguments, source, NotFoundError("DEM", dem_id))

    async def layer_level(self, digest: str, name: str, level: int) -> Path:
        """The numbers of a raster layer that was drawn, at a level; raises the same when the result was deleted."""
        path, gone = self._folder.layer(digest, level_name(name, level)), NotFoundError("result", digest)
        arguments = TileLevelArguments(digest=digest, layer=name, level=level)
        return await self._drawn(path, "write-layer-level", arguments, self._folder.result(digest), gone)

    async def _drawn(
        self, path: Path, task: str, arguments: Mapping[str, object], source: Path, gone: NotFoundError
    ) -> Path:
        if not await asyncio.to_thread(path.is_file):
            drawing = self._under_way.get(path)
            if drawing is None:
                drawing = asyncio.create_task(self._draw(path, task, arguments, source, gone))
                self._under_way[path] = drawing
                drawing.add_done_callback(lambda _: self._under_way.pop(path, None))
            # whoever goes away early must not spoil it for the others
            await asyncio.shield(drawing)
        return path

    async def _draw(
        self, path: Path, task: str, arguments: Mapping[str, object], source: Path, gone: NotFoundError
    ) -> None:
        token = uuid.uuid4().hex
        await self._supervisor.ask(task, arguments, token)
        await self._supervisor.in_store(self._keep, path, self._folder.work(token), source, gone)

    def _keep(self, path: Path, work: Path, source: Path, gone: NotFoundError) -> None:
        try:
            if not source.is_dir():
                raise gone
            move_into_place(work / path.name, path)
            self._supervisor.retention.measure_again(source.name)
        finally:
            self._folder.remove(work)
