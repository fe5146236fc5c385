"""MCAP files, read by mcap: messages of ROS 1 and 2, decoded by rosbags, and JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Schema
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .messages import Message, MessageLog, Stream
from .opening import reading

__all__ = ["opened"]

Decode = Callable[[bytes], object]


def opened(path: Path, kind: str) -> MessageLog:
    """The topics of an MCAP file."""
    decoders: dict[int, Decode | None] = {}
    counts: dict[str, int] = {}
    firsts: dict[str, tuple[str, object]] = {}
    told: list[str] = []
    try:
        with path.open("rb") as file:
            for schema, channel, message in make_reader(file).iter_messages():
                if channel.id not in decoders:
                    decoders[channel.id] = decoder = _decoder(schema, channel)
                    name = schema.name if schema else ""
                    if decoder is None:
                        told.append(f"{channel.topic} is not read: its messages are {channel.message_encoding}.")
                    elif channel.topic not in firsts:
                        firsts[channel.topic] = name, decoder(message.data)
                if decoders[channel.id] is not None:
                    counts[channel.topic] = counts.get(channel.topic, 0) + 1
    except McapError as error:
        raise ValueError(str(error) or type(error).__name__) from error

    def read(names: Collection[str]) -> Iterator[Message]:
        with reading(path, kind), path.open("rb") as file:
            for _, channel, message in make_reader(file).iter_messages(topics=list(names)):
                decode = decoders[channel.id]
                if decode is not None:
                    yield Message(channel.topic, 1e-9 * message.log_time, decode(message.data))

    streams = tuple(Stream(topic, name, counts[topic], first) for topic, (name, first) in firsts.items())
    return MessageLog("ros", kind, streams, read, told)


def _decoder(schema: Schema | None, channel: Channel) -> Decode | None:
    if channel.message_encoding == "json":
        return json.loads
    if schema is None or (schema.encoding, channel.message_encoding) not in (("ros1msg", "ros1"), ("ros2msg", "cdr")):
        return None
    name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/", 1)
    types = get_typestore(Stores.EMPTY)
    types.register(get_types_from_msg(schema.data.decode(), name))
    decode = types.deserialize_cdr if channel.message_encoding == "cdr" else types.deserialize_ros1
    return lambda data: decode(data, name)
