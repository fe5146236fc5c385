"""Requests read and checked by worker processes before they are taken in."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import nullcontext
from typing import Any

from service.settings import Settings

from .pool import Lane
from .supervisor import Supervisor

__all__ = ["Checks"]


class Checks:
    """Has requests checked; big ones never hold every process that others need."""

    def __init__(self, settings: Settings, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self._big_ones = asyncio.Semaphore(max(1, settings.file_workers - 1))

    async def ask(
        self, task: str, arguments: Mapping[str, Any], token: str | None = None, *, big: bool = False
    ) -> dict[str, Any]:
        """What the check tells. Raises as Supervisor.ask."""
        async with self._big_ones if big else nullcontext():
            return await self._supervisor.ask(task, arguments, token, Lane.CHECKS)
