"""Pixels of targets as files: tables of pixels, depth images beside images of labels, and where targets stand."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from service.errors import RequestError

from .written import written_number

if TYPE_CHECKING:
    from navigation.targets import DepthSensor, TargetPixels

__all__ = ["IMAGES", "SeenTargets", "read_places", "read_targets"]

IMAGES = (".png", ".tif", ".tiff", ".npy")
COLUMNS, PLACES = ("col", "row", "depth_m"), ("east_m", "north_m", "up_m")
NUMBERS = "number"
UNITS_M = {"m": 1.0, "mm": 1e-3}
COARSEST = 0.25  # of a depth: a step from one to the next that is wider tells none


@dataclass(frozen=True, slots=True)
class SeenTargets:
    """Pixels by the name of their target, in the order of the file, and what to know of them, in sentences."""

    pixels: dict[str, TargetPixels]
    warnings: tuple[str, ...] = ()


def read_targets(path: Path, sensor: DepthSensor, labels: Path | None = None, unit: str | None = None) -> SeenTargets:
    """Targets of a CSV of col, row, depth_m and perhaps target, or of a depth image (PNG, TIFF, .npy).

    labels: image of the same size, 0 = no target, n = target n; without it all pixels with a depth are target 1.
    unit: of an image's values, m, mm, number (of the sensor), or metres of each; by default metres of numbers with a
    fraction, millimetres of whole ones. Raises RequestError, MeasurementError.
    """
    from navigation.targets import TargetPixels

    warnings: tuple[str, ...] = ()
    if path.suffix.lower() not in IMAGES:
        if labels is not None or unit is not None:
            raise RequestError(f"--labels and --unit go with a depth image ({', '.join(IMAGES)}), not {path.name}.")
        tables, warnings = _columns(path, COLUMNS)
        found = {name: TargetPixels(*np.array(table).T) for name, table in tables.items()}
    else:
        depths_m = _depths_m(path, _image(path), sensor, unit)
        found = {
            name: TargetPixels(cols.astype(np.float64), rows.astype(np.float64), depths_m[rows, cols])
            for name, (rows, cols) in _places_by_label(path, depths_m, labels).items()
        }
    every = np.concatenate([one.depths_m for one in found.values()])
    if not len(every):
        raise RequestError(f"No pixel of {path.name} has a depth.")
    middle_m = float(np.median(every))
    step_m = float(sensor.step_m(middle_m))
    if step_m > COARSEST * middle_m:
        raise RequestError(
            f"Depths of {path.name} are about {middle_m:.4g} m, where the sensor's steps are {step_m:.3g} m; are they "
            "millimetres?"
        )
    return SeenTargets(found, warnings)


def read_places(path: Path, targets: list[str]) -> tuple[dict[str, list[float]], tuple[str, ...]]:
    """(east, north, up of each target, warnings) of a CSV of target, east_m, north_m, up_m. Raises RequestError."""
    tables, warnings = _columns(path, PLACES)
    missing = [name for name in targets if name not in tables]
    if missing:
        raise RequestError(f"{path.name} does not place {', '.join(missing)}.")
    twice = [name for name in targets if len(tables[name]) > 1]
    if twice:
        raise RequestError(f"{path.name} places {', '.join(twice)} more than once.")
    others = [name for name in tables if name not in targets]
    if others:
        warnings = (*warnings, f"{path.name} places {', '.join(others)}, of which there is no pixel.")
    return {name: tables[name][0] for name in targets}, warnings


def _columns(path: Path, names: tuple[str, ...]) -> tuple[dict[str, list[list[float]]], tuple[str, ...]]:
    """(numbers by the column target, "1" where there is none, warnings) of a CSV. Raises RequestError."""
    found: dict[str, list[list[float]]] = {}
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            given = reader.fieldnames or ()
            missing = [name for name in names if name not in given]
            if missing:
                raise RequestError(f"{path.name} has no column {', '.join(missing)}; it needs {', '.join(names)}.")
            for row in reader:
                found.setdefault(row.get("target") or "1", []).append([written_number(row[name]) for name in names])
    except OSError as error:
        raise RequestError(f"{path} cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise RequestError(f"{path.name} is no table of text.") from error
    except (ValueError, TypeError, csv.Error) as error:
        raise RequestError(f"{path.name}, line {reader.line_num}: {error}.") from error
    if not found:
        raise RequestError(f"{path.name} has no row below its header.")
    unused = [name for name in given if name not in (*names, "target")]
    return found, (f"Columns of {path.name} that are not used: {', '.join(unused)}.",) if unused else ()


def _image(path: Path) -> npt.NDArray[Any]:
    """(rows, cols) values of an image. Raises RequestError."""
    from PIL import Image, UnidentifiedImageError

    try:
        if path.suffix.lower() == ".npy":
            values = np.asarray(np.load(path, allow_pickle=False))
        else:
            with Image.open(path, formats=("PNG", "TIFF")) as image:
                values = np.asarray(image)
    except (UnidentifiedImageError, ValueError, EOFError, SyntaxError, Image.DecompressionBombError) as error:
        raise RequestError(f"{path.name} is no image that can be read (PNG, TIFF, .npy), or is cut off.") from error
    except OSError as error:
        raise RequestError(f"{path} cannot be read: {error.strerror or error}.") from error
    if values.ndim != 2 or values.dtype.kind not in "uif":
        raise RequestError(
            f"{path.name} must hold one number a pixel, rows by columns, not {values.shape} of {values.dtype.name}."
        )
    return values


def _depths_m(path: Path, values: npt.NDArray[Any], sensor: DepthSensor, unit: str | None) -> npt.NDArray[np.float64]:
    """Depths of an image's values; NaN or 0 where there is none."""
    told = unit or ("m" if values.dtype.kind == "f" else "mm")
    if told == NUMBERS:
        return sensor.depths_m(np.where(values > 0, values, np.inf))
    try:
        metres = UNITS_M[told] if told in UNITS_M else written_number(told)
    except ValueError:
        metres = math.nan
    if not 0.0 < metres < math.inf:
        raise RequestError(f"--unit takes m, mm, {NUMBERS}, or metres of each such as 0.0002, not {unit!r}.")
    return np.asarray(values, np.float64) * metres


def _places_by_label(
    path: Path, depths_m: npt.NDArray[np.float64], labels: Path | None
) -> dict[str, tuple[npt.NDArray[np.intp], ...]]:
    """(rows, cols) of the pixels of each target."""
    if labels is None:
        return {"1": np.nonzero(depths_m)}
    marks = _image(labels)
    if marks.shape != depths_m.shape or marks.dtype.kind == "f":
        told, asked = (" x ".join(map(str, one.shape)) for one in (marks, depths_m))
        raise RequestError(
            f"{labels.name} must have a whole number for each of the {asked} pixels of {path.name}, not {told} numbers "
            f"of type {marks.dtype}."
        )
    names = [int(mark) for mark in np.unique(marks) if mark != 0]
    if not names:
        raise RequestError(f"{labels.name} marks no pixel.")
    return {str(name): np.nonzero(marks == name) for name in names}
