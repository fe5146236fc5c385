"""A mesh of buildings on the command line, as the field of a request."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from service.errors import RequestError
from visibility.cover.mesh_files import read_mesh_bytes

__all__ = ["building_fields"]


def building_fields(path: Path | None, heights: str, origin: str | None) -> dict[str, Any] | None:
    """The ``buildings`` of a request; None without a file. Raises RequestError, MeshError."""
    if path is None:
        if origin is not None:
            raise RequestError("--building-origin needs --buildings FILE.")
        return None
    east_m, north_m = (0.0, 0.0) if origin is None else _origin(origin)
    return {
        "name": path.name,
        "base64": base64.b64encode(read_mesh_bytes(path)),
        "heights": heights,
        "origin_east_m": east_m,
        "origin_north_m": north_m,
    }


def _origin(text: str) -> tuple[float, float]:
    try:
        east_m, north_m = (float(part) for part in text.split(","))
    except ValueError as error:
        raise RequestError(f"--building-origin {text!r} is not of the form EAST,NORTH in metres.") from error
    return east_m, north_m
