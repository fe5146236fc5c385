"""The page about HTTP tells the default that a setting has."""

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from service.settings import Settings

PAGE = Path(__file__).resolve().parents[2] / "docs" / "http.md"
ROWS = dict(re.findall(r"^\| `SIGHTLINE_(\w+)` \| .+ \| ([^|]+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
UNITS = {"KiB": 1024, "MiB": 1024**2, "GiB": 1024**3}


def _number(text: str) -> float:
    digits, unit = re.fullmatch(r"([\d .]+?) ?(KiB|MiB|GiB)?", text).groups()
    return float(digits.replace(" ", "")) * UNITS.get(unit, 1)


@pytest.mark.parametrize("name", [name for name, field in Settings.model_fields.items() if type(field.default) is int])
def test_the_page_tells_the_default(name: str) -> None:
    assert _number(ROWS[name.upper()]) == Settings.model_fields[name].default


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("port", "80_80", "'80_80' is not a number"),
        ("max_wait_s", "1_0.5", "'1_0.5' is not a number"),
        ("keep_results_s", "1_0", "'1_0' is not a number"),
        ("max_wait_s", "inf", "finite number"),
        ("max_wait_s", "nan", "finite number"),
    ],
)
def test_a_number_of_the_environment_has_digits_alone_and_is_one(
    name: str, value: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(f"SIGHTLINE_{name.upper()}", value)
    with pytest.raises(ValidationError, match=told):
        Settings()
