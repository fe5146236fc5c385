"""Keeping a finished map on disk: raw arrays, so that its layers can be made when they are asked for."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from service.parts.map_facts import Calculation
from service.parts.sight import SightParameters
from service.products.registry import PRODUCTS, FinishedMap, product_of
from terrain import ElevationGrid, Provenance
from visibility import Anchor, DistantAnchor

__all__ = ["load", "save"]

FORMAT = 1


def save(finished: FinishedMap, folder: Path) -> None:
    """Write the map into a folder, which is made if need be; the description comes last and marks it complete.

    Raises OSError, for instance when the disk is full.
    """
    product = product_of(finished)
    folder.mkdir(parents=True, exist_ok=True)
    grid = finished.grid
    np.save(folder / "heights_m.npy", grid.heights_m, allow_pickle=False)
    for name in product.arrays:
        np.save(folder / f"{name}.npy", getattr(finished, name), allow_pickle=False)
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
        "anchor_positions_m": [(a.east_m, a.north_m, a.altitude_m) for a in finished.anchors if isinstance(a, Anchor)],
        "distant_anchors": [asdict(a) for a in finished.anchors if isinstance(a, DistantAnchor)],
        "parameters": finished.parameters.model_dump(mode="json"),
        "calculation": asdict(finished.calculation),
        "plain": {name: getattr(finished, name) for name in product.plain},
    }
    (folder / f"{product.name}.json").write_text(json.dumps(description, allow_nan=False), encoding="utf-8")


def load(folder: Path) -> FinishedMap:
    """The map saved in a folder; its big arrays are mapped, not read, until a layer needs them.

    Raises FileNotFoundError (nothing complete there), ValueError (of another format).
    """
    product = next((p for p in PRODUCTS.values() if (folder / f"{p.name}.json").is_file()), None)
    if product is None:
        raise FileNotFoundError(f"There is no finished map in {folder.name}.")
    description = json.loads((folder / f"{product.name}.json").read_text(encoding="utf-8"))
    if description.get("format") != FORMAT:
        raise ValueError(f"The {product.name} in {folder.name} has format {description.get('format')}, not {FORMAT}.")
    parameters = product.parameters.model_validate(description["parameters"])
    described = description["grid"]
    grid = ElevationGrid(
        _mapped(folder, "heights_m"),
        described["cell_east_m"],
        described["cell_north_m"],
        described["origin_east_m"],
        described["origin_north_m"],
        described["crs"],
        described["vertical_datum"],
        Provenance(**_with_tuples(described["provenance"])),
    )
    return product.finished(
        grid=grid,
        anchors=_anchors(parameters, description["anchor_positions_m"], description.get("distant_anchors", ())),
        parameters=parameters,
        calculation=Calculation(**_with_tuples(description["calculation"])),
        **{name: _mapped(folder, name) for name in product.arrays},
        **description.get("plain", {}),
    )


def _anchors(
    parameters: SightParameters, positions_m: Sequence[Sequence[float]], distant: Sequence[dict[str, Any]]
) -> tuple[Anchor | DistantAnchor, ...]:
    near = (
        Anchor(
            *(asked.id, east_m, north_m, altitude_m, asked.ranging_sigma_m, asked.pose_sigma_m),
            limits=asked.antenna_limits(),
            pose_covariance_m2=asked.pose_covariance(),
        )
        for asked, (east_m, north_m, altitude_m) in zip(parameters.near_sources(), positions_m, strict=True)
    )
    return (*near, *(DistantAnchor(**fields) for fields in distant))


def _mapped(folder: Path, name: str) -> npt.NDArray[Any]:
    array: npt.NDArray[Any] = np.load(folder / f"{name}.npy", mmap_mode="r", allow_pickle=False)
    return array


def _with_tuples(described: dict[str, Any]) -> dict[str, Any]:
    """JSON knows no tuples; our frozen values hold nothing else."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in described.items()}
