"""The page about HTTP lists every setting, with the default that it has."""

import re
from pathlib import Path

import pytest
from pydantic_core import PydanticUndefined

from service.settings import Settings

PAGE = Path(__file__).resolve().parents[2] / "docs" / "http.md"
ROWS = dict(re.findall(r"^\| `SIGHTLINE_(\w+)` \| .+ \| ([^|]+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
UNITS = {"KiB": 1024, "MiB": 1024**2, "GiB": 1024**3}


def _number(text: str) -> float:
    digits, unit = re.fullmatch(r"([\d .]+?) ?(KiB|MiB|GiB)?", text).groups()
    return float(digits.replace(" ", "")) * UNITS.get(unit, 1)


def test_the_page_lists_every_setting() -> None:
    assert set(ROWS) == {name.upper() for name in Settings.model_fields}


@pytest.mark.parametrize("name", [name for name, field in Settings.model_fields.items() if type(field.default) is int])
def test_the_page_tells_the_default(name: str) -> None:
    default = Settings.model_fields[name].default
    assert default is not PydanticUndefined
    assert _number(ROWS[name.upper()]) == default
