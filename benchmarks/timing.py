"""Timing that two runs of one program can be compared by: warm, best of several, interleaved."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["Timed", "best_of_each_s", "best_of_s"]


class Timed:
    """Measures from when it is made: no less than a quiet machine would take.

    The lesser of the clock's time, which others on the machine lengthen, and the processor's, which counts each thread.
    """

    def __init__(self) -> None:
        self._begin_s, self._begin_cpu_s = time.perf_counter(), time.process_time()

    def s(self) -> float:
        """Seconds until now."""
        return min(time.perf_counter() - self._begin_s, time.process_time() - self._begin_cpu_s)


def best_of_each_s(
    calls: Mapping[str, Callable[[], Any]], *, rounds: int = 7, budget_s: float = 20.0
) -> dict[str, float]:
    """Shortest time of each call, seconds.

    One round warms up and does not count; then the calls take turns, so that a disturbance of the machine falls on all
    of them. Stops after ``rounds`` or when ``budget_s`` is spent, but never before every call was timed twice.
    """
    best_s = dict.fromkeys(calls, float("inf"))
    started_s = time.perf_counter()
    for call in calls.values():
        call()
    for number in range(rounds):
        if number >= 2 and time.perf_counter() - started_s > budget_s:
            break
        for name, call in calls.items():
            gc.collect()
            begin_s = time.perf_counter()
            call()
            best_s[name] = min(best_s[name], time.perf_counter() - begin_s)
    return best_s


def best_of_s(call: Callable[[], Any], *, rounds: int = 7, budget_s: float = 20.0) -> float:
    """Shortest time of one call, seconds."""
    return best_of_each_s({"call": call}, rounds=rounds, budget_s=budget_s)["call"]
