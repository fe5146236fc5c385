"""How problems and headers are documented in OpenAPI."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from service.http.answers import Problem

from .problems import FRAMEWORK_KINDS, MEDIA_TYPE, PROBLEMS

__all__ = ["LOCATION", "problem_responses"]

LOCATION = {"Location": {"description": "Path of the resource.", "schema": {"type": "string"}}}


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """OpenAPI responses for these statuses and for what may happen everywhere, each a problem of some kinds."""
    return {status: _response(status) for status in sorted({*statuses, 500, 503})}


def _response(status: int) -> dict[str, Any]:
    kinds = {kind.name: kind for kind in (*PROBLEMS.values(), *FRAMEWORK_KINDS.values()) if kind.status == status}
    told = ", ".join(f"`/problems/{name}`" for name in sorted(kinds))
    documented: dict[str, Any] = {
        "description": f"{HTTPStatus(status).phrase}: {told}.",
        "content": {
            MEDIA_TYPE: {
                "schema": {"$ref": f"#/components/schemas/{Problem.__name__}"},
            }
        },
    }
    if status == 503:
        documented["headers"] = {
            "Retry-After": {"description": "Seconds after which to try again.", "schema": {"type": "integer"}}
        }
    return documented
