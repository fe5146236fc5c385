"""Numbers of every command line: with digits alone, finite, and whole where only whole ones are taken."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, get_args, get_origin

from cyclopts import Parameter, Token, convert

from service.files.written import whole_number, written_number

__all__ = ["ANY_NUMBER", "converted"]


def converted(kind: Any, tokens: Sequence[Token]) -> Any:
    """The value of an option. Raises ValueError.

    Python, whose words the library takes, would read 1_0 as 10, and the library itself 2.5 as 2.
    """
    kinds = {kind, *get_args(kind)}
    if int in kinds:
        read: Any = whole_number
    elif float in kinds:
        read = _finite
    else:
        return convert(kind, tokens)
    numbers = tuple(read(token.value) for token in tokens)
    return numbers if get_origin(kind) is tuple else numbers[0]


def _finite(text: str) -> float:
    number = written_number(text)
    if not math.isfinite(number):
        raise ValueError(f"{text!r} is no finite number")
    return number


def _any_number(kind: Any, tokens: Sequence[Token]) -> float:
    return written_number(tokens[0].value)


# for what may be "nan" or "inf" as well
ANY_NUMBER = Parameter(converter=_any_number)
