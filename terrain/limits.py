"""How much a DEM file may declare: checked on its header, before any pixel array exists."""

from __future__ import annotations

from .errors import DemFormatError, DemTooLargeError

__all__ = ["DEFAULT_MAX_CELLS", "check_declared_size"]

DEFAULT_MAX_CELLS = 300_000_000

# read, decode and convert, measured within a factor of two on one core
READ_CELLS_PER_S = 2.0e7
# result (float32) + void mask + comparisons
WORK_BYTES_PER_CELL = 6
# a constant deflated raster reaches 250 cells per byte; measured ground stays below 20
BOMB_CELLS_PER_BYTE = 200
BOMB_MIN_CELLS = 4_000_000


def check_declared_size(
    name: str, rows: int, cols: int, *, max_cells: int, bytes_per_value: int, file_bytes: int | None
) -> None:
    """Refuse a raster by its declared size alone.

    file_bytes: what the file weighs on disk, or None when the raster does not come from a file.
    Raises DemTooLargeError above ``max_cells``, DemFormatError when the declared size cannot be in so small a file.
    """
    cells = rows * cols
    if cells > max_cells:
        about = float(rows) * cols  # which has no end where the numbers of a broken file do
        gigabytes = about * (bytes_per_value + WORK_BYTES_PER_CELL) / 1e9
        raise DemTooLargeError(
            f"{name} has {cells:,} cells ({rows:,} × {cols:,}), more than the limit of {max_cells:,}; reading it would "
            f"take about {gigabytes:.3g} GB of memory and {about / READ_CELLS_PER_S:.3g} s. "
            "Cut out or coarsen the part you need, or raise max_cells.",
            cells=cells,
            limit_cells=max_cells,
        )
    if file_bytes is not None and cells > BOMB_MIN_CELLS and cells > BOMB_CELLS_PER_BYTE * file_bytes:
        raise DemFormatError(
            f"{name} declares {cells:,} cells ({rows:,} × {cols:,}) but is only {file_bytes:,} bytes long; "
            "no measured ground compresses so far, so it is not read."
        )
