"""Keeping a finished result on disk: raw arrays, so that its layers can be made when they are asked for."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ValidationError

from service.parts.sight import SightParameters
from service.products import Finished, Product
from terrain import ElevationGrid, Provenance
from visibility import Anchor, DistantAnchor

__all__ = ["load", "save"]

FORMAT = 2
READABLE = (1, 2)  # the first kept the answer in the store alone
ANSWER = "answer.json"


def save(product: Product, finished: Any, folder: Path) -> None:
    """Write a result into a folder, which is made if need be; the description comes last and marks it complete.

    Raises OSError, for instance when the disk is full.
    """
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
    }
    (folder / ANSWER).write_text(finished.answer.model_dump_json(), encoding="utf-8")
    (folder / f"{product.name}.json").write_text(json.dumps(description, allow_nan=False), encoding="utf-8")


def load(
    products: Mapping[str, Product], folder: Path, summary: Mapping[str, Any] | None = None
) -> tuple[Product, Finished]:
    """The product of a result saved in a folder, and the result; its big arrays are mapped, not read, until needed.

    summary: its answer as the store has it, for results of a Sightline that did not keep it in the folder.
    Raises FileNotFoundError (nothing complete there), ValueError (of another format).
    """
    product = next((p for p in products.values() if (folder / f"{p.name}.json").is_file()), None)
    if product is None or product.finished is None:
        raise FileNotFoundError(f"There is no finished result in {folder.name}.")
    description = json.loads((folder / f"{product.name}.json").read_text(encoding="utf-8"))
    if description.get("format") not in READABLE:
        raise ValueError(f"The {product.name} in {folder.name} has format {description.get('format')}, not {FORMAT}.")
    parameters: Any = product.parameters.model_validate(description["parameters"])
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
    finished = product.finished(
        grid=grid,
        anchors=_anchors(parameters, description["anchor_positions_m"], description.get("distant_anchors", ())),
        parameters=parameters,
        answer=_answer(product, folder, summary),
        **{name: _mapped(folder, name) for name in product.arrays},
    )
    return product, finished


def _answer(product: Product, folder: Path, summary: Mapping[str, Any] | None) -> BaseModel:
    try:
        told = json.loads((folder / ANSWER).read_text(encoding="utf-8"))
    except FileNotFoundError:
        told = {} if summary is None else dict(summary)
    try:
        return product.answer.model_validate(told)
    except ValidationError:
        # an older Sightline told less; the layers that are made of arrays alone can still be drawn
        return product.answer.model_construct(None, **told)


def _anchors(
    parameters: object, positions_m: Sequence[Sequence[float]], distant: Sequence[dict[str, Any]]
) -> tuple[Anchor | DistantAnchor, ...]:
    if not isinstance(parameters, SightParameters):
        return ()
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
