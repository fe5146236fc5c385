"""Bags of ROS 1 and 2, read by rosbags."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.typesys import Stores, get_typestore

from .messages import Message, MessageLog, Stream
from .opening import reading

__all__ = ["opened"]


def opened(path: Path, kind: str) -> MessageLog:
    """The topics of a bag: a .bag, the folder of a ROS 2 bag, or one of its .db3 files."""
    # recorders of before 2023 leave no definitions in a ROS 2 bag: those of the common messages are known
    usual = get_typestore(Stores.ROS2_HUMBLE)
    told: list[str] = []
    streams: dict[str, Stream] = {}
    try:
        with AnyReader([path], default_typestore=usual) as bag:
            for connection in bag.connections:
                if connection.msgtype not in bag.typestore.fielddefs:
                    told.append(f"{connection.topic} ({connection.msgtype}) is not read: the bag does not define it.")
                    continue
                raw = next(((one, data) for one, _, data in bag.messages([connection]) if one is connection), None)
                before = streams.get(connection.topic)
                count = connection.msgcount + (before.count if before else 0)
                first = before.first if before else raw and bag.deserialize(raw[1], connection.msgtype)
                streams[connection.topic] = Stream(connection.topic, connection.msgtype, count, first)
    except AnyReaderError as error:
        raise ValueError(str(error)) from error

    def read(names: Collection[str]) -> Iterator[Message]:
        with reading(path, kind), AnyReader([path], default_typestore=usual) as bag:
            wanted = [one for one in bag.connections if one.topic in names and one.msgtype in bag.typestore.fielddefs]
            for connection, time_ns, data in bag.messages(wanted) if wanted else ():
                yield Message(connection.topic, 1e-9 * time_ns, bag.deserialize(data, connection.msgtype))

    return MessageLog("ros", kind, tuple(streams.values()), read, told)
