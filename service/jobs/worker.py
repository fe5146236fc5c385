"""A worker process: warms up, then does one task after the other until its service goes away.

Started by ``service.machine.following``, never forked, so that no thread of the service is lost on the way. Speaks
``channel`` over stdin and stdout; whatever libraries print goes to stderr.
"""

from __future__ import annotations

import errno
import logging
import os
import queue
import re
import resource
import shutil
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyproj

from service.error_roots import domain_errors
from service.errors import DataFolderError, InternalError, MemoryLimitError, ServiceError, StorageFullError
from service.logs import set_up_logging
from service.products import Product, Work
from service.products.registry import all_products
from service.settings import GIB, Rehearsal, Settings
from service.warm_up import warm_up
from terrain import ElevationGrid

from .channel import Done, Failed, FromWorker, Order, Progress, Ready, Start, ToWorker, decode, encode
from .dem_tasks import Task, TaskContext
from .folder import DataFolder, is_full
from .kept_files import load, save
from .records import Failure
from .tasks import tasks_for

__all__ = ["main", "rehearse"]

logger = logging.getLogger("sightline.worker")

PROGRESS_EVERY_S = 0.1
# all is done of what is over; until then something is to be written still
NOT_OVER = 0.99
# libraries that a task is the first to need: address space that files stand behind
LIBRARIES_BYTES = 64 * 1024 * 1024
# of matplotlib, of C++ and GDAL, of Python's threads, of numba
OUT_OF_MEMORY = re.compile(
    r"could not be made C-contiguous|bad_alloc|out of memory|can't start new thread|allocation failed", re.IGNORECASE
)


def main() -> None:
    """Run until stdin ends."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s %(message)s")
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    started: queue.Queue[Start] = queue.Queue(1)
    orders: queue.Queue[Order] = queue.Queue()
    stopped: set[str] = set()
    threading.Thread(target=_listen, args=(started, orders, stopped), daemon=True).start()

    told = started.get()
    settings = Settings.model_validate(told["settings"])
    set_up_logging(settings.log_format)
    folder, products = DataFolder(settings.data_folder), all_products(settings.more_products)
    try:
        rehearse(settings.rehearse, products, first=told["first"])
    except OSError as error:
        # without a place for temporary files the first task is slower, nothing else
        logger.warning("could not rehearse: %s", error)
    _tell(answers, Ready(ready=True))
    tasks = tasks_for(products)
    while True:
        order = orders.get()
        _tell(answers, Ready(ready=True))
        token, progress = order["token"], _Progress(answers)
        work = folder.work(token)
        context = TaskContext(settings, products, folder, work, progress, partial(_has, stopped, token), order["salt"])
        _limit_memory(order["memory_bytes"])
        done = _done(tasks[order["task"]], order, context)
        try:
            _tell(answers, done)
        except TypeError:  # of what JSON cannot have nothing was written yet
            _tell(answers, _failed(_of_fault(order)))
        stopped.discard(token)


def rehearse(what: Rehearsal, products: Mapping[str, Product], *, first: bool) -> None:
    """Load kernels, projections and raster drivers by using each once; one small map goes from start to end.

    first: of all workers; it also compiles what the processes of sampled plans need, for itself and all others.
    Raises OSError when nothing can be written.
    """
    warm_up(what, products, own_processes=first)
    if what == "everything":
        for one in products.values():
            one.asked.model_rebuild()
            one.answer.model_rebuild()
    utm = pyproj.CRS.from_epsg(32611)
    grid = ElevationGrid(np.zeros((16, 16), np.float32), 30.0, 30.0, 400_000.0, 3_800_000.0, utm)
    anchor = {"id": "A", "lon_deg": -118.085, "lat_deg": 34.335, "altitude_m": 50.0}
    product = products["visibility-map"]
    with tempfile.TemporaryDirectory(prefix="sightline-") as folder:
        finished = product.calculate(grid, product.parameters.model_validate({"anchors": [anchor]}), Work())
        save(product, finished, Path(folder))
        _, kept = load(products, Path(folder))
        product.layer["visible.tif"].write(kept, Path(folder) / "visible.tif")


def _done(task: Task, order: Order, context: TaskContext) -> Done | Failed:
    """What comes of one task, ready to be told."""
    folder, work = context.folder, context.work
    expected: tuple[type[Exception], ...] = (*domain_errors().values(), ServiceError)
    try:
        return Done(result=dict(task(context, order["arguments"])))
    except expected as error:
        failure = Failure.of(error)
    except Exception as error:  # noqa: BLE001 - the process that answers must hear of every fault, and the log keeps it
        if _is_of_memory(error):
            failure = _of_memory(order)
        elif isinstance(error, OSError):
            failure = _of_storage(error) if is_full(error) else _of_folder(folder, order)
        else:
            failure = _of_fault(order)
    shutil.rmtree(work, ignore_errors=True)
    return _failed(failure)


def _failed(failure: Failure) -> Failed:
    return Failed(failure={"error": failure.error, "detail": failure.detail, "data": dict(failure.data)})


def _is_of_memory(error: BaseException | None) -> bool:
    """Whether memory that was refused is behind an error; libraries say it in words of their own."""
    while error is not None:
        refused = isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM)
        if refused or OUT_OF_MEMORY.search(str(error)):
            return True
        error = error.__cause__ or error.__context__
    return False


def _of_memory(order: Order) -> Failure:
    return Failure.of(
        MemoryLimitError(
            f"This needs more than the {order['memory_bytes'] / GIB:.3g} GiB of memory that it may take; ask for fewer "
            "anchors or a smaller DEM, or raise SIGHTLINE_MAX_WORKER_MEMORY_BYTES."
        )
    )


def _of_storage(error: OSError) -> Failure:
    logger.error("storage full: %s", error)
    return Failure.of(
        StorageFullError(
            f"There is no space left to write to the data folder ({error.strerror or error}); delete results or DEMs "
            "that are not needed, or make room on the disk, and try again."
        )
    )


def _of_folder(folder: DataFolder, order: Order) -> Failure:
    """Of a file that could not be used, because of the data folder as a whole or by a fault of ours."""
    try:
        folder.check_usable()
    except DataFolderError as error:
        logger.error("%s", error)
        return Failure.of(error)
    except OSError as error:
        return _of_storage(error)
    return _of_fault(order)


def _of_fault(order: Order) -> Failure:
    reference = uuid.uuid4().hex[:12]
    logger.exception("%s: task %s failed", reference, order["task"])
    return Failure.of(InternalError(reference))


class _Progress:
    """Tells the finished share, at most ten times a second."""

    def __init__(self, answers: BinaryIO) -> None:
        self._answers = answers
        self._told_at_s = 0.0

    def __call__(self, share: float) -> None:
        now_s = time.monotonic()
        if now_s - self._told_at_s >= PROGRESS_EVERY_S:
            self._told_at_s = now_s
            _tell(self._answers, Progress(progress=min(max(float(share), 0.0), NOT_OVER)))


def _tell(answers: BinaryIO, message: FromWorker) -> None:
    line = memoryview(encode(message))
    while line:
        line = line[answers.write(line) :]


def _listen(started: queue.Queue[Start], orders: queue.Queue[Order], stopped: set[str]) -> None:
    """Hand on what the service says; when it has gone, so do we, whatever we are at."""
    for line in sys.stdin.buffer:
        told: ToWorker = decode(line)
        if "stop" in told:
            stopped.add(told["stop"])
        elif "settings" in told:
            started.put(told)
        else:
            orders.put(told)
    os._exit(0)


def _has(stopped: set[str], token: str) -> bool:
    return token in stopped


def _limit_memory(bytes_on_top: int) -> None:
    """Refuse memory beyond what the process has plus what a task may take; Python then raises MemoryError."""
    if sys.platform == "linux":
        with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123 - not a file on disk
            used_bytes = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used_bytes + LIBRARIES_BYTES + bytes_on_top, resource.RLIM_INFINITY))
