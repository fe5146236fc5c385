"""Layers of finished results: drawn when first asked for, once, however many ask at the same time."""

from __future__ import annotations

import asyncio
import uuid
from pathlib import Path

from service.errors import NotFoundError

from .folder import DataFolder, move_into_place
from .supervisor import Supervisor

__all__ = ["Drawings"]


class Drawings:
    """Draws layers in worker processes and keeps them beside their result."""

    def __init__(self, folder: DataFolder, supervisor: Supervisor) -> None:
        self._folder = folder
        self._supervisor = supervisor
        self._under_way: dict[Path, asyncio.Task[None]] = {}

    async def layer(self, digest: str, name: str) -> Path:
        """The file of a layer; raises what Supervisor.ask raises, NotFoundError when the result was deleted."""
        path = self._folder.layer(digest, name)
        if not await asyncio.to_thread(path.is_file):
            drawing = self._under_way.get(path)
            if drawing is None:
                drawing = asyncio.create_task(self._draw(digest, name, path))
                self._under_way[path] = drawing
                drawing.add_done_callback(lambda _: self._under_way.pop(path, None))
            # whoever goes away early must not spoil it for the others
            await asyncio.shield(drawing)
        return path

    async def _draw(self, digest: str, name: str, path: Path) -> None:
        token = uuid.uuid4().hex
        await self._supervisor.ask("draw-layer", {"digest": digest, "layer": name}, token)
        await self._supervisor.in_store(self._keep, digest, self._folder.work(token), name, path)

    def _keep(self, digest: str, work: Path, name: str, path: Path) -> None:
        try:
            if not self._folder.result(digest).is_dir():
                raise NotFoundError("result", digest)
            move_into_place(work / name, path)
        finally:
            self._folder.remove(work)
