"""Messages among bytes: all that were sent come out, whatever was between them and however they were cut in pieces."""

from __future__ import annotations

import random

import pytest
from pymavlink.dialects.v20 import all as dialect

from service.live.bridges.mavlink_frames import Frames
from tests.service.bridges.vehicle import beacons

FALSE_V1 = bytes([254, 9, 0, 1, 1, 0])  # a heartbeat's header, and no heartbeat
FALSE_V2 = bytes([253, 250, 0, 0, 0, 1, 1, 158, 1, 0])  # a beacon's


def packed(version, seconds, signed=False):
    link = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    if signed:
        link.signing.secret_key, link.signing.sign_outgoing = bytes(range(32)), True
    told = []
    for second in seconds:
        heartbeat = dialect.MAVLink_heartbeat_message(2, 3, 81, second % 256, 4, 3)
        for message in beacons(second) if version == 2 else [heartbeat]:
            told.append(bytes(message.pack(link, force_mavlink1=version == 1)))
            link.seq = (link.seq + 1) % 256
    return told


def came_of(frames, pieces):
    return [bytes(message.get_msgbuf()) for piece in pieces for message in frames.take(piece, 0.0)]


@pytest.mark.parametrize(("version", "signed"), [(1, False), (2, False), (2, True)])
def test_every_message_comes_out_of_garbage_and_pieces(version, signed):
    draw = random.Random(3)
    sent = packed(version, range(120), signed)
    stream, garbage = b"", 0
    for message in sent:
        noise = draw.randbytes(draw.randrange(40)) if draw.random() < 0.5 else b""
        garbage += len(noise)
        stream += noise + message
    # what a false header waits for comes with these
    end = [bytes(range(100, 200)) * 3]
    cuts = sorted(draw.sample(range(len(stream)), 400))
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    frames = Frames()
    assert came_of(frames, pieces + end) == sent
    assert frames.bad == garbage + 300


def test_the_same_bytes_again_and_again_block_nothing():
    """pymavlink's own parser goes round in such a circle for ever: each false message ends within the next true one."""
    sent = packed(2, [0])
    again = b"".join(sent)
    frames = Frames()
    for begin in range(1, len(again), 7):
        assert came_of(frames, [again[begin:], again])[-6:] == sent


@pytest.mark.parametrize("header", [FALSE_V1, FALSE_V2, b"\xfd", b"\xfe"])
def test_silence_ends_the_wait_for_a_message_that_is_none(header):
    sent = packed(1, [0])
    frames = Frames()
    at_once = came_of(frames, [header + sent[0]])
    assert frames.late(0.05) == []
    late = [bytes(message.get_msgbuf()) for message in frames.late(0.2)]
    assert at_once + late == sent
    assert frames.late(0.4) == []
    assert frames.bad == len(header)


def test_half_a_message_outlasts_a_silence():
    (sent,) = packed(1, [0])
    frames = Frames()
    assert came_of(frames, [sent[:9]]) == []
    assert frames.late(5.0) == []
    assert came_of(frames, [sent[9:]]) == [sent]
    assert frames.bad == 0


def test_a_message_of_another_dialect_is_passed_over():
    (sent,) = packed(1, [0])
    strange = bytes([253, 3, 0, 0, 0, 1, 1, 1, 2, 99, 5, 6, 7, 8, 9])
    frames = Frames()
    assert came_of(frames, [strange + sent]) == [sent]
    assert frames.bad == len(strange)
