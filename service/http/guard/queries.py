"""Nothing in a query is passed over: a parameter that the route does not know, or that is said twice, is refused.

Numbers in queries and paths have digits alone: Python and pydantic read 1_0 as 10.
"""

from __future__ import annotations

from collections import Counter
from typing import get_args, get_origin

from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, APIWebSocketRoute
from starlette.requests import HTTPConnection

from service.errors import NotValidError
from service.parts.sentences import MOST_FIELDS

__all__ = ["refuse_unknown"]

NAMED = 3
NUMBERS = (int, float, int | None, float | None)


async def refuse_unknown(connection: HTTPConnection) -> None:
    """Hold the query against what the route declares: a dependency of every route. Raises NotValidError."""
    route: APIRoute | APIWebSocketRoute = connection.scope["route"]
    for field in route.dependant.path_params:
        _refuse_no_number("path", field.alias, connection.path_params[field.alias], field.field_info.annotation)
    asked = Counter(name for name, _ in connection.query_params.multi_items())
    if not asked:
        return
    known = _declared(route.dependant)
    unknown = [name[:40] for name in asked if name not in known]
    if unknown:
        named = ", ".join(map(repr, unknown[:NAMED])) + (" …" if len(unknown) > NAMED else "")
        takes = f"which takes {', '.join(sorted(known))}" if known else "which takes none"
        errors = [{"field": name, "detail": "is not a parameter of the query"} for name in unknown[:MOST_FIELDS]]
        raise NotValidError(f"{named} in the query is not known here, {takes}.", errors)
    for name, value in connection.query_params.multi_items():
        _refuse_no_number("query", name, value, known[name])
    twice = [name for name, times in asked.items() if times > 1 and not _is_list(known[name])]
    if twice:
        errors = [{"field": name, "detail": "is there more than once"} for name in twice]
        raise NotValidError(f"The query has {twice[0]!r} {asked[twice[0]]:,} times; give it once.", errors)


def _refuse_no_number(where: str, name: str, value: str, kind: object) -> None:
    if "_" in value and kind in NUMBERS:
        errors = [{"field": name, "detail": "is not a number"}]
        raise NotValidError(f"The {where} has {name} {value[:40]!r}, which is not a number.", errors)


def _declared(dependant: Dependant) -> dict[str, object]:
    """The type of each parameter that the route, or what it depends on, declares."""
    known: dict[str, object] = {field.alias: field.field_info.annotation for field in dependant.query_params}
    for part in dependant.dependencies:
        known |= _declared(part)
    return known


def _is_list(annotation: object) -> bool:
    return get_origin(annotation) is list or any(get_origin(one) is list for one in get_args(annotation))
