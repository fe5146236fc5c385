"""PX4's ULog, read by pyulog."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator
from pathlib import Path

from pyulog import ULog

from .messages import Message, MessageLog, Stream
from .opening import reading

__all__ = ["opened"]


def opened(path: Path, kind: str) -> MessageLog:
    """The topics of a ULog; instances of one beyond the first are called topic[1], topic[2] …"""
    with path.open("rb") as file:
        log = ULog(file)
    topics = {f"{one.name}[{one.multi_id}]" if one.multi_id else one.name: one for one in log.data_list}
    streams = tuple(
        Stream(name, one.name, len(one.data["timestamp"]), {key: values[0].item() for key, values in one.data.items()})
        for name, one in topics.items()
        if len(one.data["timestamp"])
    )

    def messages(name: str) -> Iterator[Message]:
        columns = {key: values.tolist() for key, values in topics[name].data.items()}
        for number, time_us in enumerate(columns["timestamp"]):
            yield Message(name, 1e-6 * time_us, {key: values[number] for key, values in columns.items()})

    def read(names: Collection[str]) -> Iterator[Message]:
        with reading(path, kind):
            yield from heapq.merge(*(messages(name) for name in topics if name in names), key=lambda one: one.time_s)

    lost_s = 1e-3 * sum(one.duration for one in log.dropouts)
    told = [f"The log lost {lost_s:.2f} s in {len(log.dropouts)} dropouts."] if log.dropouts else []
    told += ["The log is damaged; what could be read of it is."] if log.file_corruption else []
    return MessageLog("ulog", kind, streams, read, told)
