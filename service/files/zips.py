"""Zips of somebody else, opened with bounds: what is damaged in any way, or packed in a rare one, is one sentence."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.errors import RequestError

__all__ = ["member_blocks", "opened_zip"]

BLOCK_BYTES = 1024 * 1024
# the two that KMZ and numpy know; others take memory as their heads say
PACKINGS = frozenset({zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED})
# of directories that lead nowhere zipfile seeks and slices as they say: OSError, ValueError, IndexError
DAMAGE = (
    *(zipfile.BadZipFile, zlib.error, OSError, ValueError, IndexError, EOFError),
    *(OverflowError, NotImplementedError, RuntimeError),
)


@contextmanager
def opened_zip(file: Path | io.BytesIO, sentence: str) -> Iterator[zipfile.ZipFile]:
    """The zip, its directory read. Raises RequestError with the sentence for one whose directory is damaged."""
    try:
        archive = zipfile.ZipFile(file)
    except DAMAGE as error:
        raise RequestError(sentence) from error
    with archive:
        yield archive


def member_blocks(archive: zipfile.ZipFile, member: zipfile.ZipInfo, sentence: str) -> Iterator[bytes]:
    """What a member unpacks to, block by block, whatever the directory says of its size.

    Raises RequestError with the sentence for one that is damaged, encrypted or neither stored nor deflated.
    """
    if member.compress_type not in PACKINGS:
        raise RequestError(sentence)
    try:
        with archive.open(member) as file:
            while block := file.read(BLOCK_BYTES):
                yield block
    except DAMAGE as error:
        raise RequestError(sentence) from error
