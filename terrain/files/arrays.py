"""DEMs as numpy files: Sightline's own .npz, and bare heights in an .npy."""

from __future__ import annotations

import io
import json
import lzma
import math
import os
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..crs.parts import horizontal_part
from ..crs.texts import parse_crs
from ..errors import DemFormatError, DemUnsupportedError
from ..grid import ElevationGrid
from ..limits import check_declared_size
from .raw import PostWindow, RawDem, RawHead

__all__ = ["npz_head", "read_npy", "read_npz", "write_npz"]

LAYOUT = "sightline-dem-1"
NPZ_NUMBERS = ("cell_east_m", "cell_north_m", "origin_east_m", "origin_north_m")
NPZ_TEXTS = ("layout", "crs_wkt", "vertical_datum", "provenance")
HEAD_BYTES = 1 << 16
# a CRS as WKT has a few thousand characters; what unpacks to more is no description of a grid
MAX_DETAIL_BYTES = 4_000_000

# everything that zipfile, zlib and numpy's header parser raise over damaged bytes
DAMAGE = (
    zipfile.BadZipFile, zlib.error, tokenize.TokenError, SyntaxError, ValueError, TypeError, KeyError, OSError,
    EOFError, OverflowError, NotImplementedError, RuntimeError, lzma.LZMAError,
)  # fmt: skip


def write_npz(grid: ElevationGrid, path: str | os.PathLike[str]) -> None:
    """Write a grid as .npz, compressed, without pickles; ``read_dem`` gives the same grid back, digest included."""
    notes = {"conversions": grid.provenance.conversions, "warnings": grid.provenance.warnings}
    target = Path(path)
    with target.open("wb") as stream:
        np.savez_compressed(
            stream,
            allow_pickle=False,
            layout=np.array(LAYOUT),
            heights_m=grid.heights_m,
            cell_east_m=np.float64(grid.cell_east_m),
            cell_north_m=np.float64(grid.cell_north_m),
            origin_east_m=np.float64(grid.origin_east_m),
            origin_north_m=np.float64(grid.origin_north_m),
            crs_wkt=np.array(grid.crs.to_wkt() if grid.crs is not None else ""),
            vertical_datum=np.array(grid.vertical_datum or ""),
            provenance=np.array(json.dumps(notes)),
        )


def npz_head(file: Path, *, max_cells: int | None = None) -> RawHead:
    """What an .npz says of itself; only ``heights_m`` and the two cell sizes must be there.

    Raises DemFormatError, DemUnsupportedError and, with ``max_cells``, DemTooLargeError.
    """
    try:
        with zipfile.ZipFile(file) as archive, archive.open("heights_m.npy") as member:
            packed_bytes = archive.getinfo("heights_m.npy").compress_size
            rows, cols = _check_header(file.name, member, max_cells, packed_bytes)
            for detail in archive.infolist():
                if detail.filename.removesuffix(".npy") in {*NPZ_NUMBERS, *NPZ_TEXTS}:
                    _check_detail(file.name, archive, detail)
        with np.load(file, allow_pickle=False) as arrays:
            numbers = {key: float(arrays[key]) for key in NPZ_NUMBERS if key in arrays}
            texts = {key: str(arrays[key]) for key in NPZ_TEXTS if key in arrays}
        conversions, warnings = _notes(texts)
    except DAMAGE as error:
        raise DemFormatError(f"{file.name} is a damaged .npz file, or holds something other than numbers.") from error
    if not {"cell_east_m", "cell_north_m"} <= numbers.keys():
        raise DemUnsupportedError(f"{file.name} lacks cell_east_m and cell_north_m, the metres between its posts.")
    return RawHead(
        rows, cols, 1,
        x0=numbers.get("origin_east_m", 0.0),
        y0=numbers.get("origin_north_m", 0.0),
        step_x=numbers["cell_east_m"],
        step_y=numbers["cell_north_m"],
        south_up=False,
        scale=1.0,
        offset=0.0,
        height_unit="m",
        crs=horizontal_part(parse_crs(texts["crs_wkt"])) if texts.get("crs_wkt") else None,
        crs_height_unit=None,
        vertical_datum=texts.get("vertical_datum") or None,
        conversions=conversions,
        warnings=warnings,
        from_grid=texts.get("layout") == LAYOUT,
    )  # fmt: skip


def read_npz(file: Path, *, max_cells: int, window: PostWindow | None = None) -> RawDem:
    """Read ``heights_m`` with its geometry; the file is unpacked whole, whatever window of posts is wanted.

    Raises DemFormatError, DemTooLargeError (before the heights are unpacked) and DemUnsupportedError.
    """
    head = npz_head(file, max_cells=max_cells)
    try:
        with np.load(file, allow_pickle=False) as arrays:
            values = arrays["heights_m"]
    except DAMAGE as error:
        raise DemFormatError(f"{file.name} is a damaged .npz file, or holds something other than numbers.") from error
    first_row, last_row, first_col, last_col = window or (0, head.rows - 1, 0, head.cols - 1)
    return RawDem(
        values[first_row : last_row + 1, first_col : last_col + 1],
        None,
        x0=head.x0 + first_col * head.step_x,
        y0=head.y0 - first_row * head.step_y,
        step_x=head.step_x,
        step_y=head.step_y,
        crs=head.crs,
        driver="NPZ",
        height_unit="m",
        vertical_datum=head.vertical_datum,
        from_grid=head.from_grid,
        conversions=head.conversions,
        warnings=head.warnings,
    )


def read_npy(file: Path, *, cell_m: tuple[float, float] | None, max_cells: int) -> RawDem:
    """Read bare heights (rows, cols), row 0 northmost; ``cell_m`` (east, north) is needed.

    Raises DemFormatError, DemTooLargeError (before the heights are read) and DemUnsupportedError.
    """
    if cell_m is None:
        raise DemUnsupportedError(f"{file.name} holds heights alone; give cell_m=, the metres between its posts.")
    try:
        with file.open("rb") as stream:
            _check_header(file.name, stream, max_cells, file.stat().st_size)
        values = np.load(file, allow_pickle=False)
    except DAMAGE as error:
        raise DemFormatError(f"{file.name} is a damaged .npy file, or holds something other than numbers.") from error
    return RawDem(values, None, 0.0, 0.0, *cell_m, crs=None, driver="NPY")


def _notes(texts: dict[str, str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """(conversions, warnings) that ``write_npz`` kept. Raises ValueError or TypeError when they are not that."""
    if texts.get("layout") != LAYOUT:
        return (), ()
    notes = json.loads(texts["provenance"])
    return tuple(map(str, notes["conversions"])), tuple(map(str, notes["warnings"]))


def _check_detail(name: str, archive: zipfile.ZipFile, detail: zipfile.ZipInfo) -> None:
    """Refuse a number or text that is, or says that it is, far more than one: a small file must not fill the memory."""
    with archive.open(detail) as member:
        shape, kind = _header(member)
    if max(detail.file_size, kind.itemsize * math.prod(shape)) > MAX_DETAIL_BYTES:
        raise DemFormatError(f"{name} holds far too much as {detail.filename!r}, where one number or text belongs.")


def _check_header(name: str, stream: IO[bytes], max_cells: int | None, packed_bytes: int) -> tuple[int, int]:
    """(rows, cols) of an array of heights. Raises DemUnsupportedError, DemFormatError, DemTooLargeError."""
    shape, kind = _header(stream)
    if len(shape) != 2 or 0 in shape or kind.kind not in "fiu":
        raise DemUnsupportedError(f"{name} must hold a (rows, cols) array of real heights, not {shape} of {kind}.")
    if max_cells is not None:
        check_declared_size(name, *shape, max_cells=max_cells, bytes_per_value=kind.itemsize, file_bytes=packed_bytes)
    rows, cols = shape
    return rows, cols


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    # a head may say that it is gigabytes long, and would be given them
    stream = io.BytesIO(stream.read(HEAD_BYTES))
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read(stream)
    return shape, kind
