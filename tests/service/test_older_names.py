"""Fields that were renamed are taken under their older names, and that is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import pytest
from pydantic import Field, ValidationError

from service.parts.points import StrictModel
from service.parts.sentences import WithOlderNames, notes_on_older_names


class Limits(WithOlderNames):
    older_names: ClassVar[Mapping[str, str]] = {"max_dop": "dop_limit"}

    dop_limit: float | None = Field(None, gt=0.0, description="Limit, no unit.")


class Asked(StrictModel):
    limits: Limits
    more: tuple[Limits, ...] = ()


def test_an_older_name_gives_the_field_its_value_and_is_told() -> None:
    for asked in (
        Asked.model_validate({"limits": {"max_dop": 4.0}, "more": [{"max_dop": 5.0}]}),
        Asked.model_validate_json('{"limits": {"max_dop": 4.0}, "more": [{"max_dop": 5.0}]}'),
    ):
        assert (asked.limits.dop_limit, asked.more[0].dop_limit) == (4.0, 5.0)
        assert len(notes_on_older_names(asked)) == 2
        assert "max_dop is called dop_limit now" in notes_on_older_names(asked)[0]


def test_todays_name_is_not_told_of() -> None:
    assert notes_on_older_names(Asked.model_validate({"limits": {"dop_limit": 4.0}})) == []


def test_both_names_at_once_are_refused() -> None:
    with pytest.raises(ValidationError, match="older name of dop_limit"):
        Limits.model_validate({"max_dop": 4.0, "dop_limit": 4.0})


def test_openapi_shows_the_older_name_as_deprecated() -> None:
    properties = Limits.model_json_schema()["properties"]
    assert properties["max_dop"]["deprecated"]
    assert "deprecated" not in properties["dop_limit"]
