"""The one shape of every error answer: RFC 9457, application/problem+json."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["FieldProblem", "Problem", "ProblemType"]


class FieldProblem(BaseModel):
    """One thing wrong with one field of the request."""

    field: str = Field(description="Where in the request, for instance anchors[0].east_m.")
    detail: str = Field(description="What is wrong with it.")


class Problem(BaseModel):
    """What went wrong, for people (detail) and for programs (type)."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/anchor",
                    "title": "An anchor cannot be used",
                    "status": 422,
                    "detail": "Anchor D1 is 12.4 m below the ground (612.4 m there); raise it or give above_ground_m.",
                    "instance": "/visibility-maps",
                }
            ]
        },
    )

    type: str = Field(description="Stable name of the kind of problem, a reference to its description.")
    title: str = Field(description="What kind of problem it is.")
    status: int = Field(description="The HTTP status.")
    detail: str = Field(description="One sentence about this very problem and what to do.")
    instance: str | None = Field(None, description="Path of the request, or of the job that failed.")
    errors: list[FieldProblem] | None = Field(None, description="Every field that is wrong, when fields are.")


class ProblemType(BaseModel):
    """A kind of problem."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/anchor",
                    "title": "An anchor cannot be used",
                    "status": 422,
                    "description": "An anchor cannot be used.",
                }
            ]
        }
    )

    type: str = Field(description="Stable name, as in the `type` of a problem.")
    title: str = Field(description="What kind of problem it is.")
    status: int = Field(description="The HTTP status it comes with.")
    description: str = Field(description="What it means.")
