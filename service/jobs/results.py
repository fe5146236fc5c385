"""Keeping a finished result on disk: raw arrays, so that its layers can be made when they are asked for."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, JsonValue, ValidationError

from service.parts.sight import SightParameters
from service.products import Finished, Product
from visibility import Anchor, DistantAnchor

from .kept_files import GridFields, grid_fields, grid_of

__all__ = ["load", "save"]

FORMAT = 2
READABLE = (1, 2)  # the first kept the answer in the store alone
ANSWER = "answer.json"


class DistantFields(TypedDict):
    """A ``DistantAnchor``, ready for JSON."""

    id: str
    azimuth_rad: float
    elevation_rad: float
    range_m: float
    ranging_sigma_m: float


class ResultFields(TypedDict):
    """What is kept of a result besides its arrays and its answer."""

    format: int
    grid: GridFields
    anchor_positions_m: Sequence[Sequence[float]]
    distant_anchors: NotRequired[Sequence[DistantFields]]
    parameters: Mapping[str, JsonValue]


def save(product: Product, finished: Any, folder: Path) -> None:
    """Write a result into a folder, which is made if need be; the description comes last and marks it complete.

    Raises OSError, for instance when the disk is full.
    """
    folder.mkdir(parents=True, exist_ok=True)
    grid = finished.grid
    np.save(folder / "heights_m.npy", grid.heights_m, allow_pickle=False)
    for name in product.arrays:
        np.save(folder / f"{name}.npy", getattr(finished, name), allow_pickle=False)
    description: ResultFields = {
        "format": FORMAT,
        "grid": grid_fields(grid),
        "anchor_positions_m": [(a.east_m, a.north_m, a.altitude_m) for a in finished.anchors if isinstance(a, Anchor)],
        "distant_anchors": [_distant_fields(a) for a in finished.anchors if isinstance(a, DistantAnchor)],
        "parameters": finished.parameters.model_dump(mode="json"),
    }
    (folder / ANSWER).write_text(finished.answer.model_dump_json(), encoding="utf-8")
    (folder / f"{product.name}.json").write_text(json.dumps(description, allow_nan=False), encoding="utf-8")


def load(
    products: Mapping[str, Product], folder: Path, summary: Mapping[str, JsonValue] | None = None
) -> tuple[Product, Finished]:
    """The product of a result saved in a folder, and the result; its big arrays are mapped, not read, until needed.

    summary: its answer as the store has it, for results of a Sightline that did not keep it in the folder.
    Raises FileNotFoundError (nothing complete there), ValueError (of another format).
    """
    product = next((p for p in products.values() if (folder / f"{p.name}.json").is_file()), None)
    if product is None or product.finished is None:
        raise FileNotFoundError(f"There is no finished result in {folder.name}.")
    description: ResultFields = json.loads((folder / f"{product.name}.json").read_text(encoding="utf-8"))
    if description.get("format") not in READABLE:
        raise ValueError(f"The {product.name} in {folder.name} has format {description.get('format')}, not {FORMAT}.")
    parameters: Any = product.parameters.model_validate(description["parameters"])
    grid = grid_of(folder / "heights_m.npy", description["grid"])
    finished = product.finished(
        grid=grid,
        anchors=_anchors(parameters, description["anchor_positions_m"], description.get("distant_anchors", ())),
        parameters=parameters,
        answer=_answer(product, folder, summary),
        **{name: _mapped(folder, name) for name in product.arrays},
    )
    return product, finished


def _answer(product: Product, folder: Path, summary: Mapping[str, JsonValue] | None) -> BaseModel:
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
    parameters: object, positions_m: Sequence[Sequence[float]], distant: Sequence[DistantFields]
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


def _distant_fields(anchor: DistantAnchor) -> DistantFields:
    return DistantFields(
        id=anchor.id,
        azimuth_rad=anchor.azimuth_rad,
        elevation_rad=anchor.elevation_rad,
        range_m=anchor.range_m,
        ranging_sigma_m=anchor.ranging_sigma_m,
    )


def _mapped(folder: Path, name: str) -> npt.NDArray[Any]:
    array: npt.NDArray[Any] = np.load(folder / f"{name}.npy", mmap_mode="r", allow_pickle=False)
    return array
