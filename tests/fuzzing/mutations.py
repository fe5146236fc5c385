"""Damage to files, the same for the same number: bytes, cuts, repeats, extreme numbers, broken text."""

from __future__ import annotations

import random
import re

__all__ = ["damaged"]

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eEdD][-+]?\d+)?")
EXTREMES = (
    *(b"0", b"-1", b"1", b"2147483648", b"4294967296", b"9223372036854775808", b"-9999", b"1e308", b"1e999", b"-1e999"),
    *(
        b"nan",
        b"inf",
        b"",
        b"1e-320",
        b"99999999999999999999999999",
        b"0x10",
        b"1_0",
        b"1,5",
        b"--1",
        b"9" * 400,
        b"3D300",
    ),
)
BROKEN = (
    *(b"\xff\xfe", b"\x00", b"\xc3\x28", b"\xed\xa0\x80", b"\xe2\x28\xa1", b"\r", b"\n", b"\t", b'"', b"'", b"\x1b[2J"),
    *(b"$$", b"=1+1", b"{", b"[" * 5000, b"}", b"]", b",", b";", b"</a>", b"%s", b"\xef\xbb\xbf", b"A" * 3000, b"\x85"),
)
INTEGERS = tuple(
    value.to_bytes(width, order) for width in (2, 4, 8) for order in ("little", "big")
    for value in (0, 1, 2 ** (8 * width) - 1, 2 ** (8 * width - 1))
)  # fmt: skip


def damaged(data: bytes, seed: str) -> bytes:
    """The data with one to four faults."""
    rng = random.Random(seed)
    for _ in range(rng.randint(1, 4)):
        data = rng.choice((_number, _number, _text, _integer, _bytes, _cut, _repeat, _remove, _swap))(data, rng) or b"x"
    return data


def _at(data: bytes, rng: random.Random) -> int:
    """A place, more often near the beginning, where heads are."""
    return rng.randrange(min(len(data), rng.choice((64, 400, 10**7))))


def _number(data: bytes, rng: random.Random) -> bytes:
    found = NUMBER.search(data, _at(data, rng))
    return data if found is None else data[: found.start()] + rng.choice(EXTREMES) + data[found.end() :]


def _text(data: bytes, rng: random.Random) -> bytes:
    at = _at(data, rng)
    return data[:at] + rng.choice(BROKEN) + data[at + rng.choice((0, 0, 1, 4)) :]


def _integer(data: bytes, rng: random.Random) -> bytes:
    at, value = _at(data, rng), rng.choice(INTEGERS)
    return data[:at] + value + data[at + len(value) :]


def _bytes(data: bytes, rng: random.Random) -> bytes:
    at = _at(data, rng)
    return data[:at] + rng.randbytes(rng.randint(1, 8)) + data[at + rng.randint(0, 8) :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: _at(data, rng)] if rng.random() < 0.3 else data[: len(data) - rng.randint(1, 40)]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    at = _at(data, rng)
    some = data[at : at + rng.randint(1, 200)]
    return data[:at] + some * rng.choice((2, 3, 50)) + data[at:]


def _remove(data: bytes, rng: random.Random) -> bytes:
    at = _at(data, rng)
    return data[:at] + data[at + rng.randint(1, 60) :]


def _swap(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)
