"""Opens a log of messages by what its first bytes say it is; the readers of each format are an optional extra."""

from __future__ import annotations

import contextlib
import io
import struct
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from service.errors import RequestError

from .messages import MessageLog

__all__ = ["kind_of", "open_messages", "reading"]

TELEMETRY, DATAFLASH_TEXT, BAG_FOLDER = "MAVLink telemetry", "DataFlash as text", "ROS 2 bag"
# first bytes: what it is
MAGIC = {
    b"\x89MCAP0\r\n": "MCAP",
    b"#ROSBAG": "ROS 1 bag",
    b"SQLite format 3\x00": BAG_FOLDER,
    b"ULog\x01\x12\x35": "PX4 ULog",
    b"\xa3\x95": "DataFlash",
    b"FMT, ": DATAFLASH_TEXT,
}
# what it is: the module that opens it, and the packages that this one needs
READERS = {
    BAG_FOLDER: ("ros_bags", "rosbags"),
    "ROS 1 bag": ("ros_bags", "rosbags"),
    "MCAP": ("mcap_files", "mcap and rosbags"),
    "PX4 ULog": ("ulog_files", "pyulog"),
    "DataFlash": ("mavlink_files", "pymavlink"),
    DATAFLASH_TEXT: ("mavlink_files", "pymavlink"),
    TELEMETRY: ("mavlink_files", "pymavlink"),
}
PACKET = (0xFD, 0xFE)  # MAVLink 2 and 1, after eight bytes of time
# what libraries raise for files that are damaged
DAMAGED: tuple[type[Exception], ...] = (
    ValueError, LookupError, TypeError, AttributeError, ArithmeticError, EOFError, OSError, AssertionError,
    RuntimeError, struct.error, MemoryError,
)  # fmt: skip


def kind_of(path: Path) -> str | None:
    """What a log of messages is; None for one that is a table or lines of JSON. Raises RequestError."""
    if path.is_dir():
        return BAG_FOLDER if (path / "metadata.yaml").exists() else None
    try:
        with path.open("rb") as file:
            begin = file.read(16)
    except OSError as error:
        raise RequestError(f"The log {str(path)!r} cannot be read: {error.strerror}.") from error
    found = next((kind for magic, kind in MAGIC.items() if begin.startswith(magic)), None)
    if found is None and (path.suffix.lower() == ".tlog" or (len(begin) > 8 and begin[8] in PACKET and begin[0] < 32)):
        return TELEMETRY
    return found


def open_messages(path: Path) -> MessageLog:
    """The streams of a log of messages. Raises RequestError, also while messages are read."""
    kind = kind_of(path)
    if kind is None:
        raise RequestError(f"The log {path.name} is no log of messages that is known here.")
    module, packages = READERS[kind]
    try:
        opener: Callable[[Path, str], MessageLog] = import_module(f"service.files.logs.{module}").opened
    except ImportError as error:
        raise RequestError(
            f"The log {path.name} is {kind}; to read it, install {packages}: pip install 'sightline[logs]'."
        ) from error
    with reading(path, kind):
        return opener(path, kind)


@contextlib.contextmanager
def reading(path: Path, kind: str) -> Iterator[None]:
    """What the libraries print is not for people who asked for JSON, and what they raise becomes a sentence."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            yield
        except Exception as error:
            if not isinstance(error, DAMAGED) and type(error) is not Exception:  # pymavlink raises that itself
                raise
            raise RequestError(f"The log {path.name} is no whole {kind}: {_one_line(error, path)}.") from error


def _one_line(error: Exception, path: Path) -> str:
    """What a library said, with the name of the file where it told its whole path."""
    said = " ".join(str(error).replace(str(path), path.name).split()) or type(error).__name__
    return said[:200].encode("ascii", "replace").decode().rstrip(".")
