"""``sightline serve``: the HTTP service."""

from __future__ import annotations

from typing import Any

from service.http.serve import serve
from service.settings import Settings

__all__ = ["start_service"]


def start_service(options: dict[str, Any]) -> None:
    """Serve until told to stop; options that are None are left to the environment and the defaults."""
    serve(Settings(**{name: value for name, value in options.items() if value is not None}))
