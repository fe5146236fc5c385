"""What the `type` of a problem means."""

from __future__ import annotations

from fastapi import APIRouter

from service.errors import NotFoundError
from service.http.answers import ProblemType
from service.http.documented import problem_responses
from service.http.problems import METHOD, PROBLEMS

__all__ = ["router"]

router = APIRouter(prefix="/problems", tags=["Problems"])
DOCUMENTED = [*((kind, error.__doc__) for error, kind in PROBLEMS.items()), (METHOD, "Another method is needed.")]
TYPES = {
    kind.name: ProblemType(
        type=f"/problems/{kind.name}", title=kind.title, status=kind.status, description=(words or kind.title).strip()
    )
    for kind, words in DOCUMENTED
}


@router.get("", summary="List the kinds of problems", responses=problem_responses())
async def list_problem_types() -> list[ProblemType]:
    """Every `type` that a problem may have."""
    return [TYPES[name] for name in sorted(TYPES)]


@router.get("/{name}", summary="Look up a kind of problem", responses=problem_responses(404))
async def get_problem_type(name: str) -> ProblemType:
    """What a `type` means; it is the path of this very answer."""
    if name not in TYPES:
        raise NotFoundError("kind of problem", name)
    return TYPES[name]
