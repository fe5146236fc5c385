"""The other end of a MAVLink link: a vehicle that ranges, and keeps what it is told."""

from __future__ import annotations

import socket
import time

from pymavlink.dialects.v20 import all as dialect

from tests.service.bridges.running import PLACES, ranges_m

BOOT_S = 100.0  # of the first epoch, by the vehicle's clock


class Vehicle:
    """Speaks as system 1 over a connection; ``told`` holds all it was sent, by name."""

    def __init__(self, port, system=1):
        self.port, self.system = port, system
        self.told = {}
        self.line = None
        self.bad = 0

    def connect(self):
        end_s = time.monotonic() + 20.0
        while True:
            try:
                self.line = socket.create_connection(("127.0.0.1", self.port), 5.0)
                break
            except ConnectionRefusedError:
                assert time.monotonic() < end_s
                time.sleep(0.02)
        self.line.settimeout(0.01)
        self.link = dialect.MAVLink(None, srcSystem=self.system, srcComponent=1)
        self.parser = dialect.MAVLink(None)
        self.parser.robust_parsing = True
        return self

    def close(self):
        self.line.close()

    def packed(self, *messages):
        data = b""
        for message in messages:
            data += bytes(message.pack(self.link))
            self.link.seq = (self.link.seq + 1) % 256
        return data

    def send(self, *messages):
        self.line.sendall(self.packed(*messages))

    def hear(self):
        """What came; True where something did."""
        try:
            data = self.line.recv(65536)
        except TimeoutError:
            return False
        for message in self.parser.parse_buffer(data) or ():
            self.told.setdefault(message.get_type(), []).append(message)
        return bool(data)

    def until(self, true, seconds=20.0):
        end_s = time.monotonic() + seconds
        while not true():
            assert time.monotonic() < end_s, f"it did not come to be; told {[*self.told]}"
            self.hear()

    def count(self, name):
        return len(self.told.get(name, ()))


def beacons(second, hidden=(), places=None, sequence=0):
    """RANGING_BEACON of each anchor; places: (lon, lat, altitude) that it tells, nothing by default."""
    usec = round(1e6 * (BOOT_S + second))
    unknown = 2147483647
    return [
        dialect.MAVLink_ranging_beacon_message(
            usec,
            0,
            0,
            int(name),
            round(1000.0 * range_m),
            unknown if places is None else round(1e7 * places[name][1]),
            unknown if places is None else round(1e7 * places[name][0]),
            float("nan") if places is None else places[name][2],
            dialect.RANGING_BEACON_ALT_TYPE_MSL,
            0,
            0,
            0,
            4294967295,
            sequence,
            0,
        )
        for name, range_m in ranges_m(second, hidden).items()
    ]


def distances(second):
    """The same as ranges of a distance sensor."""
    return [
        dialect.MAVLink_distance_sensor_message(
            round(1000.0 * (BOOT_S + second)), 10, 65000, round(100.0 * range_m), 4, int(name), 0, 255
        )
        for name, range_m in ranges_m(second).items()
    ]


def names():
    return list(PLACES)
