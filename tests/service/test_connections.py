"""Who gives way when there are as many connections as there may be."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from service.http.guard.connections import MOMENT_S, Connections
from service.settings import Settings

MOST = 40


@dataclass(eq=False)
class Connection:
    """One over which nothing is asked since some seconds ago."""

    address: str
    idle_s: float
    begun_s: float = field(default_factory=time.monotonic)
    ended: bool = False

    @property
    def idle_since_s(self) -> float | None:
        return self.begun_s - self.idle_s

    def look(self, now_s: float) -> str | None:
        return None

    def end(self, slow_in: str | None) -> None:
        self.ended = True

    def forget_slowness(self, now_s: float) -> None:
        """It is measured nowhere."""


@pytest.fixture
def connections(tmp_path: Path) -> Connections:
    return Connections(Settings(data_folder=tmp_path, max_connections=MOST, max_client_connections=MOST))


def entered(connections: Connections, address: str, number: int, *, idle_s: float, asked: bool) -> list[Connection]:
    new = [Connection(address, idle_s) for _ in range(number)]
    for one in new:
        assert connections.enter(one) is None
        if asked:
            connections.asked(one)
    return new


def test_the_crowd_makes_room_and_not_who_was_answered_a_moment_ago(connections: Connections) -> None:
    clients = entered(connections, "client", 5, idle_s=3.0 * MOMENT_S, asked=True)
    crowd = entered(connections, "crowd", 20, idle_s=0.0, asked=False)
    crowd += entered(connections, "another crowd", 15, idle_s=0.0, asked=False)
    for _ in range(100):  # those that are closed come again at once
        crowd.append(Connection("crowd", 0.0))
        connections.enter(crowd[-1])
    assert not any(one.ended for one in clients)
    late = Connection("late client", 0.0)
    assert connections.enter(late) is None
    assert not any(one.ended for one in (late, *clients))


def test_of_one_address_the_oldest_gives_way_and_what_just_came_does_not(connections: Connections) -> None:
    old = entered(connections, "one", 1, idle_s=3.0 * MOMENT_S, asked=False)
    young = entered(connections, "one", MOST - 1, idle_s=0.0, asked=False)
    assert connections.enter(Connection("one", 0.0)) is None
    assert [one.ended for one in old] == [True]
    assert connections.enter(Connection("one", 0.0)) is not None  # refused
    assert not any(one.ended for one in young)
