"""Numbers of options, of every command: digits alone, finite, and whole where only whole ones are taken."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from cyclopts import App, CycloptsError

from service.cli.app import command_line, exit_code_of

# unknown posts may be marked by a number that is none
READS_ITS_OWN = {"--nodata"}
APP = command_line()


def commands(app: App, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], App]]:
    for name in app:
        if not name.startswith("-"):
            yield from commands(app[name], (*words, name))
    if app.default_command is not None and words:
        yield words, app


def given(*words: str) -> dict[str, Any]:
    _, bound, _ = APP.parse_args(words, exit_on_error=False, print_error=False)
    return dict(bound.arguments)


def test_no_number_of_any_command_is_read_in_a_way_of_its_own() -> None:
    own, count = set(), 0
    for _, app in commands(APP):
        for one in app.assemble_argument_collection():
            if not one.children and {one.hint, *get_args(one.hint)} & {int, float}:
                count += 1
                own |= {one.name} if one.parameter.converter else set()
    assert count > 300
    assert own == READS_ITS_OWN


@pytest.mark.parametrize("value", ["1_0", "٣", "much", "nan", "-inf", "1e400", "1e", "0x10", ""])
@pytest.mark.parametrize(
    ("words", "option"),
    [
        (("info", "x"), "--cell-m"),
        (("info", "x"), "--band"),
        (("reposition", "x"), "--height"),
        (("missions", "restore", "x"), "VERSION"),
    ],
    ids=["a number", "a whole one", "several", "an argument"],
)
def test_what_is_no_number_is_told_so(
    words: tuple[str, ...], option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(CycloptsError) as error:
        given(*words, *([f"{option}={value}"] if option.startswith("--") else [value]))
    assert exit_code_of(error.value) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"Invalid value for '{option}': {value!r} is no ")
    assert told.endswith("number.\n")


def test_numbers_are_read_as_they_are_written() -> None:
    reading = given("info", "x", "--nodata", "nan", "--cell-m", "+1.5e1", "--band", "2")["reading"]
    assert math.isnan(reading.nodata)
    assert (reading.cell_m, reading.band) == (15.0, 2)
    moves = given("reposition", "x", "--height", "60", "--height", "-.5")
    assert moves["moves"].heights_above_ground_m == (60.0, -0.5)
