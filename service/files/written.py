"""Numbers as texts write them: what Python reads besides, 1_0 and the digits of other scripts, is no number."""

from __future__ import annotations

__all__ = ["whole_number", "written_number"]


def written_number(text: str) -> float:
    """The number in a text, which may be "nan" or "inf". Raises ValueError."""
    return float(_plain(text))


def whole_number(text: str) -> int:
    """The whole number in a text. Raises ValueError."""
    return int(_plain(text))


def _plain(text: str) -> str:
    if "_" in text or not text.isascii():
        raise ValueError(f"{text[:40]!r} is not a number")
    return text
