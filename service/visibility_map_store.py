"""Keeping a finished visibility map on disk: raw arrays, so that its layers can be made when they are asked for."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj

from terrain import ElevationGrid, Provenance
from visibility import Anchor

from .map_facts import Calculation
from .schemas.visibility_maps import VisibilityMapParameters
from .visibility_map import VisibilityMap

__all__ = ["load", "save"]

DESCRIPTION = "visibility-map.json"
FORMAT = 1


def save(finished: VisibilityMap, folder: Path) -> None:
    """Write the map into a folder, which is made if need be; the description comes last and marks it complete.

    Raises OSError, for instance when the disk is full.
    """
    folder.mkdir(parents=True, exist_ok=True)
    grid = finished.grid
    for name, array in (
        ("heights_m", grid.heights_m),
        ("visible", finished.visible),
        ("altitude_m", finished.altitude_m),
        ("count", finished.count),
        ("unknown_count", finished.unknown_count),
    ):
        np.save(folder / f"{name}.npy", array, allow_pickle=False)
    description = {
        "format": FORMAT,
        "grid": {
            "cell_east_m": grid.cell_east_m,
            "cell_north_m": grid.cell_north_m,
            "origin_east_m": grid.origin_east_m,
            "origin_north_m": grid.origin_north_m,
            "crs": None if grid.crs is None else grid.crs.to_wkt(),
            "vertical_datum": grid.vertical_datum,
            "provenance": asdict(grid.provenance),
        },
        "anchor_positions_m": [(a.east_m, a.north_m, a.altitude_m) for a in finished.anchors],
        "parameters": finished.parameters.model_dump(mode="json"),
        "calculation": asdict(finished.calculation),
    }
    (folder / DESCRIPTION).write_text(json.dumps(description, allow_nan=False), encoding="utf-8")


def load(folder: Path) -> VisibilityMap:
    """The map saved in a folder; its big arrays are mapped, not read, until a layer needs them.

    Raises FileNotFoundError (nothing complete there), ValueError (of another format).
    """
    description = json.loads((folder / DESCRIPTION).read_text(encoding="utf-8"))
    if description.get("format") != FORMAT:
        raise ValueError(f"The visibility map in {folder.name} has format {description.get('format')}, not {FORMAT}.")
    parameters = VisibilityMapParameters.model_validate(description["parameters"])
    described = description["grid"]
    grid = ElevationGrid(
        _mapped(folder, "heights_m"),
        described["cell_east_m"],
        described["cell_north_m"],
        described["origin_east_m"],
        described["origin_north_m"],
        None if described["crs"] is None else pyproj.CRS.from_wkt(described["crs"]),
        described["vertical_datum"],
        Provenance(**_with_tuples(described["provenance"])),
    )
    anchors = tuple(
        Anchor(asked.id, east_m, north_m, altitude_m, asked.ranging_sigma_m, asked.pose_sigma_m, asked.antenna_limits())
        for asked, (east_m, north_m, altitude_m) in zip(
            parameters.anchors, description["anchor_positions_m"], strict=True
        )
    )
    return VisibilityMap(
        grid,
        anchors,
        parameters,
        _mapped(folder, "visible"),
        _mapped(folder, "altitude_m"),
        _mapped(folder, "count"),
        _mapped(folder, "unknown_count"),
        Calculation(**_with_tuples(description["calculation"])),
    )


def _mapped(folder: Path, name: str) -> npt.NDArray[Any]:
    array: npt.NDArray[Any] = np.load(folder / f"{name}.npy", mmap_mode="r", allow_pickle=False)
    return array


def _with_tuples(described: dict[str, Any]) -> dict[str, Any]:
    """JSON knows no tuples; our frozen values hold nothing else."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in described.items()}
