"""The same MAVLink over datagrams and over a serial line, of which a pair of pseudo-terminals is one."""

from __future__ import annotations

import os
import random
import select
import socket
import tty

import pytest
from pymavlink.dialects.v20 import all as dialect

from service.live.bridges.running import mavlink_bridge
from tests.service.bridges.running import Judge, free_port, running, site
from tests.service.bridges.vehicle import BOOT_S, Vehicle, beacons

MIDDLE = {"lon_deg": 10.94, "lat_deg": 46.37, "up_m": 0.0}
EPOCHS = 30


class Datagrams:
    """What a ``Vehicle`` takes for a socket: every send a datagram to the bridge."""

    def __init__(self, port):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.settimeout(0.01)

    def sendall(self, data):
        self._socket.send(data)

    def recv(self, most):
        try:
            return self._socket.recv(most)
        except ConnectionRefusedError as error:  # nobody listens yet
            raise TimeoutError from error

    def close(self):
        self._socket.close()


class Terminal:
    """The same over the near end of a pair of pseudo-terminals, a few bytes at a time as a slow line gives them."""

    def __init__(self):
        self._near, far = os.openpty()
        for end in (self._near, far):
            tty.setraw(end)
        self.device = os.ttyname(far)
        self._far = far

    def sendall(self, data):
        for begin in range(0, len(data), 37):
            os.write(self._near, data[begin : begin + 37])

    def recv(self, most):
        if not select.select([self._near], [], [], 0.01)[0]:
            raise TimeoutError
        return os.read(self._near, most)

    def close(self):
        os.close(self._near)
        os.close(self._far)


def over(line):
    vehicle = Vehicle(0)
    vehicle.line = line
    vehicle.link = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    vehicle.parser = dialect.MAVLink(None)
    vehicle.parser.robust_parsing = True
    return vehicle


def driven(vehicle, garbage, seconds):
    """Every epoch until it is answered; what garbage swallowed, or nobody heard yet, is sent again."""
    draw = random.Random(5)
    answered = set()
    for second in seconds:
        data = vehicle.packed(*beacons(second))
        tries = 0
        while second not in answered:
            assert tries < 2000, f"epoch {second} was never answered"
            if tries % 50 == 0:
                vehicle.line.sendall((draw.randbytes(draw.randrange(1, 60)) if garbage else b"") + data)
            tries += 1
            vehicle.hear()
            told = vehicle.told.pop("VISION_POSITION_ESTIMATE", ())
            answered.update(round(one.usec / 1e6 - BOOT_S) for one in told)
    return answered


@pytest.mark.parametrize("garbage", [False, True])
@pytest.mark.parametrize("way", ["datagrams", "serial"])
def test_every_epoch_is_answered_and_judged_once(way, garbage):
    judge = Judge()
    if way == "serial":
        line = Terminal()
        address = f"serial:{line.device}:115200"
    else:
        port = free_port()
        line, address = Datagrams(port), f"udp:127.0.0.1:{port}"
    bridge = mavlink_bridge(site(MIDDLE), address, 0.25, judge, {}, {}, {})
    vehicle = over(line)
    with running(bridge):
        # while a serial line is opened what it held is dropped, be it half a message
        answered = driven(vehicle, garbage, range(1))
        at_first = bridge.bad
        answered |= driven(vehicle, garbage, range(1, EPOCHS))
    vehicle.close()
    assert answered == set(range(EPOCHS))
    used = [round(asked.key - BOOT_S) for asked, result in judge.epochs if result.rejection is None]
    assert sorted(used) == list(range(EPOCHS))
    assert (bridge.bad > at_first) == garbage
