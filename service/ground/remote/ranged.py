"""A file on a server, read by parts: for a raster library it is a file like any other."""

from __future__ import annotations

import io
import re
import time
from typing import TYPE_CHECKING

from terrain import GroundSourceError

from .blocks import BLOCK_BYTES, BlockStore, RemoteFile

if TYPE_CHECKING:
    import httpx

__all__ = ["RangedFile", "client_of"]

CONNECT_S, READ_S = 10.0, 30.0
TRIES, PAUSE_S = 4, 0.5
CONTENT_RANGE = re.compile(r"bytes (\d+)-(\d+)/(\d+)")
NOT_THERE = (403, 404, 410)  # buckets answer 403 for what is not in them


def client_of(read_s: float = READ_S) -> httpx.Client:
    """A client that follows no redirect: what is asked is what the operator listed, and nothing else."""
    import httpx  # it takes a while to load

    return httpx.Client(follow_redirects=False, timeout=httpx.Timeout(read_s, connect=CONNECT_S))


class RangedFile:
    """Reads blocks out of the store, and those that are not there from the server; each is kept at once.

    failure: the first error of a view: a raster library that reads there would turn it into one of its own.
    Raises GroundSourceError.
    """

    def __init__(self, client: httpx.Client, url: str, store: BlockStore) -> None:
        self._client, self._store = client, store
        self._confirmed = False
        self.failure: GroundSourceError | None = None
        known = store.file(url)
        self._file = known or RemoteFile(url, -1, "")
        if known is None:
            self._fetch(0)  # tells the length

    @classmethod
    def opened(cls, client: httpx.Client, url: str, store: BlockStore) -> RangedFile | None:
        """The file; None where the server has none of that name. Raises GroundSourceError."""
        try:
            return cls(client, url, store)
        except _NotThereError:
            return None

    @property
    def length(self) -> int:
        """Of the file, bytes."""
        return self._file.length

    def view(self) -> io.RawIOBase:
        """The file as a stream of its own, which ends early where the server fails."""
        return _View(self)

    def part(self, first: int, end: int) -> bytes:
        """Some bytes; fewer at the end of the file. Raises GroundSourceError."""
        parts = []
        while first < min(end, self.length):
            number, skip = divmod(first, BLOCK_BYTES)
            parts.append(self._block(number)[skip : skip + end - first])
            first += len(parts[-1])
        return b"".join(parts)

    def _block(self, number: int) -> bytes:
        kept = self._store.get(self._file.url, number)
        if kept is not None and len(kept) == self._length_of(number):
            return kept
        return self._fetch(number)

    def _length_of(self, number: int) -> int:
        return min(BLOCK_BYTES, self._file.length - number * BLOCK_BYTES)

    def _fetch(self, number: int) -> bytes:
        """Ask for a block, again after a pause while the server fails."""
        import httpx  # as above

        for attempt in range(TRIES):
            try:
                return self._asked(number)
            except (httpx.TransportError, _TryAgainError) as error:
                if attempt == TRIES - 1:
                    why = str(error) or type(error).__name__
                    raise GroundSourceError(
                        f"{self._named} could not be read after {TRIES} tries ({why.rstrip('.')}); what came is kept, "
                        "so asking again goes on from there."
                    ) from error
                time.sleep(PAUSE_S * 2**attempt)
        raise AssertionError("the last try returns or raises")

    def _asked(self, number: int) -> bytes:
        first = number * BLOCK_BYTES
        last = first + BLOCK_BYTES - 1
        answer = self._client.get(
            self._file.url, headers={"Range": f"bytes={first}-{last}", "Accept-Encoding": "identity"}
        )
        told = self._checked(answer, first, last)
        if self._file.length < 0 or (told.length, told.version) != (self._file.length, self._file.version):
            if self._confirmed:
                raise GroundSourceError(f"{self._named} changed while it was read; ask again.")
            self._store.begin(told)
            self._file = told
        self._confirmed = True
        self._store.put(told.url, number, answer.content)
        return answer.content

    def _checked(self, answer: httpx.Response, first: int, last: int) -> RemoteFile:
        if answer.status_code in NOT_THERE and self._file.length < 0:
            raise _NotThereError(f"{self._named} is not there.")
        if answer.is_redirect:
            raise GroundSourceError(
                f"{self._named} redirects elsewhere ({answer.headers.get('location', '')[:80]}), which is not "
                "followed: only what the operator lists is asked."
            )
        if answer.status_code >= 500 or answer.status_code == 429:
            raise _TryAgainError(f"the server answers {answer.status_code}")
        if "html" in answer.headers.get("content-type", "") or answer.content[:512].lstrip().lower().startswith(
            (b"<!doctype", b"<html")
        ):
            raise GroundSourceError(f"{self._named} answers with a web page instead of ground.")
        found = CONTENT_RANGE.fullmatch(answer.headers.get("content-range", ""))
        if answer.status_code != 206 or found is None:
            raise GroundSourceError(
                f"{self._named} gives no parts of files (status {answer.status_code}); a source must understand ranges."
            )
        start, end, length = (int(group) for group in found.groups())
        if start != first or end != min(last, length - 1):
            raise GroundSourceError(f"{self._named} gives another part of the file than it was asked for.")
        if len(answer.content) != end - start + 1:
            raise _TryAgainError(f"{len(answer.content):,} bytes came where {end - start + 1:,} were promised")
        return RemoteFile(self._file.url, length, answer.headers.get("etag", ""))

    @property
    def _named(self) -> str:
        return f"The source's file {self._file.url.rsplit('/', 1)[-1]}"


class _View(io.RawIOBase):
    """A stream over a remote file. It never raises: that would go through a raster library that cannot take it."""

    def __init__(self, file: RangedFile) -> None:
        super().__init__()
        self._file, self._at = file, 0

    def readable(self) -> bool:
        """It is."""
        return True

    def seekable(self) -> bool:
        """It is."""
        return True

    def tell(self) -> int:
        """Where the next byte is read."""
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._file.length}[whence]
        self._at = max(base + offset, 0)
        return self._at

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override] # 3.11 has no Buffer
        """Fill the buffer from here; with nothing once the server has failed."""
        into = memoryview(buffer).cast("B")
        try:
            found = b"" if self._file.failure else self._file.part(self._at, self._at + len(into))
        except GroundSourceError as error:
            self._file.failure = error
            found = b""
        into[: len(found)] = found
        self._at += len(found)
        return len(found)


class _NotThereError(GroundSourceError):
    """The server has no such file."""


class _TryAgainError(Exception):
    """What may go better the next time."""
