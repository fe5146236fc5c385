"""What is known along a trajectory, as a table that spreadsheets open."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from service.files.tables import TableWriter
from service.products.dop.calculate import FinishedDopMap
from service.products.dop.paths import PATH_COLUMNS
from visibility import DopReason

__all__ = ["write_path"]


def write_path(finished: FinishedDopMap, path: Path) -> None:
    """One line per point: PATH_COLUMNS, reason in words, and the ids in sight, with spaces between."""
    ids = [anchor.id for anchor in finished.anchors]
    bits = np.unpackbits(finished.path_sets.astype("<u8").view(np.uint8), axis=1, bitorder="little")[:, : len(ids)]
    reason, whole = (
        PATH_COLUMNS.index("reason"),
        (PATH_COLUMNS.index("anchors_in_sight"), PATH_COLUMNS.index("unknown")),
    )
    with path.open("w", encoding="utf-8", newline="") as file:
        table = TableWriter(file, end="\r\n")
        table.row([*PATH_COLUMNS, "ids_in_sight"])
        for numbers, seen in zip(finished.path_numbers.tolist(), bits, strict=True):
            cells: list[str] = [f"{number:.10g}" for number in numbers]
            cells[reason] = DopReason(int(numbers[reason])).name.lower()
            for column in whole:
                cells[column] = str(int(numbers[column]))
            table.row([*cells, " ".join(ids[number] for number in np.flatnonzero(seen))])
