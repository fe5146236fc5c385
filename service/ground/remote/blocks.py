"""Parts of remote files, kept: blocks with their digests in a folder of bounded size, the least used go first."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from service.files.layer import replacing
from terrain import GroundSourceError

__all__ = ["BLOCK_BYTES", "BlockStore", "RemoteFile"]

BLOCK_BYTES = 256 * 1024
DIGEST_BYTES = 32
# when room is made, so much of the store stays
KEPT_SHARE = 0.9


@dataclass(frozen=True, slots=True)
class RemoteFile:
    """What is known of a file elsewhere: its length, and its version as the server tells it."""

    url: str
    length: int
    version: str


class BlockStore:
    """The folder; many processes may use it at once, since every file in it is written whole and never changed."""

    def __init__(self, folder: Path, max_bytes: int) -> None:
        self._folder = folder
        self._max_bytes = max_bytes
        self._held_bytes: int | None = None  # as far as this process knows

    def file(self, url: str) -> RemoteFile | None:
        """What is kept of that file; None where nothing is."""
        try:
            return RemoteFile(**json.loads((self._of(url) / "file.json").read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None

    def begin(self, file: RemoteFile) -> None:
        """Keep what is known of a file; blocks of another version of it are dropped. Raises OSError."""
        before, folder = self.file(file.url), self._of(file.url)
        if before == file:
            return
        for block in folder.glob("*.block"):
            block.unlink(missing_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        with replacing(folder / "file.json") as unfinished:
            unfinished.write_text(json.dumps(asdict(file)), encoding="utf-8")

    def get(self, url: str, number: int) -> bytes | None:
        """A block; None where it is not there or is not what was written."""
        path = self._of(url) / f"{number}.block"
        try:
            content = path.read_bytes()
            os.utime(path)
        except OSError:
            return None
        digest, block = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
        return block if hashlib.sha256(block).digest() == digest else None

    def put(self, url: str, number: int, block: bytes) -> None:
        """Keep a block, and make room for it. Raises GroundSourceError where the store has no room, OSError."""
        if len(block) + DIGEST_BYTES > self._max_bytes:
            raise GroundSourceError(
                f"The store of remote ground is full: it may hold {self._max_bytes:,} bytes "
                "(setting SIGHTLINE_MAX_GROUND_STORE_BYTES)."
            )
        self._make_room(len(block) + DIGEST_BYTES)
        with replacing(self._of(url) / f"{number}.block") as unfinished:
            unfinished.write_bytes(hashlib.sha256(block).digest() + block)

    def _make_room(self, more_bytes: int) -> None:
        """Drop what was used least lately, a little more than is needed: looking at all blocks takes a while."""
        if self._held_bytes is not None and self._held_bytes + more_bytes <= self._max_bytes:
            self._held_bytes += more_bytes
            return
        kept = sorted(self._kept())
        held_bytes = sum(size for _, size, _ in kept)
        if held_bytes + more_bytes > self._max_bytes:
            for _, size, path in kept:
                if held_bytes + more_bytes <= KEPT_SHARE * self._max_bytes:
                    break
                path.unlink(missing_ok=True)
                held_bytes -= size
        self._held_bytes = held_bytes + more_bytes

    def _kept(self) -> list[tuple[int, int, Path]]:
        """(when it was used last, bytes, path) of each block."""
        kept = []
        for path in self._folder.glob("*/*.block"):
            try:
                found = path.stat()
            except OSError:  # another process has just dropped it
                continue
            kept.append((found.st_mtime_ns, found.st_size, path))
        return kept

    def _of(self, url: str) -> Path:
        return self._folder / hashlib.sha256(url.encode()).hexdigest()[:32]
