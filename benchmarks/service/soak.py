"""Hours of use in one go: maps and epochs under retention, then kills at random moments; what grew, and what was lost.

    python -m benchmarks.service.soak [--maps 20000] [--epochs 1000000] [--kills 100] [--seed 0]      (make soak)

Memory is that of the server and its workers with what they share counted each time, descriptors those of the server,
disk all of the data folder. Each is looked at after every twentieth of the maps, then of the epochs; what grows with
a thousand of them is the slope of a line through all looks but the first, when caches are not warm yet. Who ends it
early (Ctrl-C, or SIGTERM) is told what there is so far.
"""

from __future__ import annotations

import argparse
import itertools
import random
import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil

from service.live.request import ANCHORS, RANGES
from tests.service.running import Server, running

KEEP_S, KEEP_BYTES = 20.0, 20_000_000
EPOCHS_AT_ONCE = 500
LOOKS = 20
GONE_WITHIN_S = 6.0
# a dem of so many posts a side takes a map of some milliseconds
SIDE = 60


@dataclass(frozen=True, slots=True)
class Taken:
    """What a service takes at one moment."""

    server_bytes: int
    workers_bytes: int
    descriptors: int
    disk_bytes: int


@dataclass(frozen=True, slots=True)
class Lost:
    """What kills left behind: of finished results, half files and folders, and processes."""

    kills: int
    within_commits: int
    results: int
    half: tuple[str, ...]
    orphans: int
    set_aside: int  # whole results whose job was killed before the store knew them, and began again


def taken(server: Server) -> Taken:
    process = psutil.Process(server.process.pid)
    files = (path for path in server.folder.rglob("*") if path.is_file())
    return Taken(
        process.memory_info().rss,
        sum(worker.memory_info().rss for worker in server.workers),
        process.num_fds(),
        sum(_size(path) for path in files),
    )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # retention was quicker
        return 0


def ground(server: Server, place: Path) -> dict[str, Any]:
    np.save(place / "hill.npy", np.random.default_rng(1).normal(100.0, 5.0, (SIDE, SIDE)).astype(np.float32))
    return server.upload(place / "hill.npy", cell_m=10.0)


def question(dem: dict[str, Any], number: int) -> dict[str, Any]:
    """Another map for each number."""
    anchor = {"id": "A", "east_m": 300.0, "north_m": 300.0 - SIDE * 10.0, "above_ground_m": 5.0 + 0.001 * number}
    bounds = dem["bounds_of_posts_m"]
    anchor |= {"east_m": (bounds["east"] + bounds["west"]) / 2, "north_m": (bounds["north"] + bounds["south"]) / 2}
    return {"dem_id": dem["id"], "anchors": [anchor]}


def make_map(server: Server, dem: dict[str, Any], number: int) -> httpx.Response:
    return server.client.post("/visibility-maps", json=question(dem, number), headers={"Prefer": "wait=60"})


def maps(server: Server, dem: dict[str, Any], numbers: range) -> None:
    for number in numbers:
        answer = make_map(server, dem, number)
        assert answer.status_code == 201, answer.text


def epochs(server: Server, session: str, numbers: range) -> None:
    for first in range(numbers.start, numbers.stop, EPOCHS_AT_ONCE):
        some = [{"time_s": 0.1 * n, "ranges": RANGES} for n in range(first, min(first + EPOCHS_AT_ONCE, numbers.stop))]
        server.client.post(f"{session}/epochs", json={"epochs": some}).raise_for_status()


def opened(server: Server) -> str:
    """The path of a new session."""
    return str(server.client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().headers["Location"])


def use(place: Path, map_count: int, epoch_count: int) -> Iterator[tuple[str, int, Taken]]:
    """Ask for so many maps and epochs under retention; what the service takes after each twentieth of either."""
    kept: dict[str, Any] = {"keep_results_s": KEEP_S, "max_results_bytes": KEEP_BYTES}
    with running(place / "use", workers=1, spare_workers=0, rehearse="maps", access_log=False, **kept) as server:
        dem = ground(server, place)
        asks: dict[str, tuple[Callable[[Server, Any, range], None], Callable[[], Any], int]] = {
            "maps": (maps, lambda: dem, map_count),
            # opened when maps are done: it would expire meanwhile
            "epochs": (epochs, lambda: opened(server), epoch_count),
        }
        for what, (ask, made, count) in asks.items():
            if not count:
                continue
            of = made()
            ends = [count * part // LOOKS for part in range(LOOKS + 1)]
            for begin, end in itertools.pairwise(ends):
                ask(server, of, range(begin, end))
                yield what, end, taken(server)


def growth(looks: Sequence[tuple[int, float]]) -> float:
    """Of a number that was looked at after so much work: how much more it is with each thousand, caches being warm."""
    work, numbers = np.array(looks[1:], float).T
    return float(np.polyfit(work / 1000.0, numbers, 1)[0])


@contextmanager
def _asking(server: Server, dem: dict[str, Any], number: int) -> Iterator[str]:
    """A map that is asked for, and not waited for."""
    yield str(server.client.post("/visibility-maps", json=question(dem, number)).headers["Location"])


def kill(place: Path, kills: int, seed: int) -> Lost:
    """Kill the server or its workers again and again, a third of the times while a result is being committed."""
    choose, kept, orphans, within = random.Random(seed), {}, 0, 0
    folder, number, dem = place / "killed", 0, None
    settings: dict[str, Any] = {"workers": 1, "spare_workers": 0, "rehearse": "maps"}
    done = 0
    while done < kills:
        with running(folder, **settings) as server:
            dem = ground(server, place) if dem is None else dem
            for _ in range(choose.randint(1, 4)):
                number += 1
                answer = make_map(server, dem, number)
                if answer.status_code == 201:
                    kept[answer.headers["Location"]] = _layer(server, answer.json())
            processes = [psutil.Process(server.process.pid), *server.workers]
            while done < kills:
                done += 1
                number += 1
                with _asking(server, dem, number) as job:
                    if choose.random() < 1 / 3:
                        within += _until_committing(server, job)
                    else:
                        time.sleep(choose.random() * 0.1)
                    if choose.random() < 0.4:
                        break
                    server.kill_workers()
                    kept_now = server.until_over(job)
                    if kept_now["status"] == "succeeded":
                        kept[job] = _layer(server, kept_now)
            server.kill()
            orphans += _left(processes)
            print(f"{done:,} kills, {within:,} while a result was written, {orphans:,} processes left", flush=True)
    with running(folder, **settings) as server:
        lost = sum(not _is_there(server, path, layer) for path, layer in kept.items())
        unfinished = server.client.get("/visibility-maps", params={"limit": 200}).json()["visibility_maps"]
        for one in unfinished:
            server.until_over(one["links"]["self"])
        return Lost(done, within, lost, _half(folder), orphans, server.client.get("/health").json()["quarantined"])


def _until_committing(server: Server, job: str) -> bool:
    """Until the files of a result are being written, or the job is over; whether they are being written."""
    work = server.folder / "work"
    deadline_s = time.monotonic() + 5.0
    while time.monotonic() < deadline_s:
        if any(work.iterdir()):
            return True
        if server.client.get(job).json()["status"] not in ("queued", "running"):
            break
    return False


def _is_there(server: Server, path: str, layer: bytes) -> bool:
    told = server.client.get(path)
    return told.status_code == 200 and _layer(server, told.json()) == layer


def _layer(server: Server, job: dict[str, Any]) -> bytes:
    """The bytes of a result's first layer; a service that is busy for now is asked again."""
    deadline_s = time.monotonic() + 60.0
    while (answer := server.client.get(job["layers"][0]["href"])).status_code == 503:
        assert time.monotonic() < deadline_s, answer.text
        time.sleep(0.1)
    assert answer.is_success, "\n".join([answer.text, *server.said[-40:]])
    return answer.content


def _half(folder: Path) -> tuple[str, ...]:
    """What is still half a file or folder after a while."""
    deadline_s = time.monotonic() + GONE_WITHIN_S
    while True:
        left = [*(folder / "work").iterdir(), *(folder / "incoming").iterdir(), *folder.rglob("*.unfinished")]
        if not left or time.monotonic() > deadline_s:
            return tuple(str(path.relative_to(folder)) for path in left)
        time.sleep(0.05)


def _left(processes: list[psutil.Process]) -> int:
    """How many still run after a while; one that is dead and that nobody has buried yet does not."""
    deadline_s = time.monotonic() + GONE_WITHIN_S
    while time.monotonic() < deadline_s:
        if not any(map(_runs, processes)):
            return 0
        time.sleep(0.05)
    return sum(map(_runs, processes))


def _runs(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


def _tell(looks: Sequence[tuple[str, int, Taken]], begun_s: float) -> None:
    if not looks:
        return
    for what in dict.fromkeys(what for what, _, _ in looks):
        these = [(count, took) for of, count, took in looks if of == what]
        last = f"after {these[-1][0]:,}"
        print(f"\n{what:20}{f'after {these[0][0]:,}':>18}{'least':>12}{'most':>12}{last:>18}{'growth per 1,000':>20}")
        for words, name, unit in (
            ("server, MB", "server_bytes", 1e6),
            ("workers, MB", "workers_bytes", 1e6),
            ("descriptors", "descriptors", 1.0),
            ("data folder, MB", "disk_bytes", 1e6),
        ):
            all_of_it = [(count, getattr(took, name) / unit) for count, took in these]
            numbers = [number for _, number in all_of_it]
            grown = f"{growth(all_of_it):20.4f}" if len(these) > 2 else f"{'–':>20}"
            print(f"{words:20}{numbers[0]:18.1f}{min(numbers):12.1f}{max(numbers):12.1f}{numbers[-1]:18.1f}{grown}")
    print(f"\n{time.monotonic() - begun_s:.0f} s", flush=True)


def main() -> None:
    """Print what was taken and what was lost; exit 1 where something was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, number in (("maps", 20_000), ("epochs", 1_000_000), ("kills", 100), ("seed", 0)):
        parser.add_argument(f"--{name}", type=int, default=number)
    told = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    looks, begun_s = list[tuple[str, int, Taken]](), time.monotonic()
    with tempfile.TemporaryDirectory() as place:
        try:
            if told.maps or told.epochs:
                for look in use(Path(place), told.maps, told.epochs):
                    looks.append(look)
                    print(f"{time.monotonic() - begun_s:6.0f} s: {look[1]:,} {look[0]}", flush=True)
        except KeyboardInterrupt:
            raise SystemExit(130) from None
        finally:
            _tell(looks, begun_s)
        lost = kill(Path(place), told.kills, told.seed)
    print(
        f"{lost.kills} kills, {lost.within_commits} while a result was written: {lost.results} results lost, "
        f"{len(lost.half)} half files {lost.half}, {lost.orphans} processes left after {GONE_WITHIN_S:g} s; "
        f"{lost.set_aside} whole results set aside; {time.monotonic() - begun_s:.0f} s"
    )
    if lost.results or lost.half or lost.orphans:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
