"""What the data folder keeps: DEMs, finished results as raw arrays, and whether the files of a store are sound.

A DEM's heights lie as a plain .npy that processes can share, everything else as JSON.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import numpy as np
from pydantic import BaseModel, JsonValue, ValidationError

from service.jobs.kept_cover import CoverFields, mapped_array, save_cover, with_kept_cover
from service.parts.anchors import AskedSources
from service.parts.doubts import DoubtParameters, doubted_anchors
from service.parts.radios import SightChoice
from service.products import Finished, Product
from terrain import ElevationGrid, LargeDem, Provenance, RasterFile
from terrain.crs.texts import parse_crs
from visibility import Anchor, DistantAnchor

from .folder import digest_of, make_durable
from .recovery import NOTES

__all__ = [
    "GridFields",
    "copy_files",
    "digest_of_files",
    "grid_fields",
    "grid_of",
    "is_sound",
    "load",
    "load_grid",
    "save",
    "save_grid",
]

HEIGHTS = "heights_m.npy"
DESCRIPTION = "grid.json"
FORMAT = 2
READABLE = (1, 2)  # the first kept the answer in the store alone
ANSWER = "answer.json"


class ProvenanceFields(TypedDict):
    """A ``Provenance``, ready for JSON."""

    source: str
    driver: str
    conversions: Sequence[str]
    warnings: Sequence[str]
    overview_of: NotRequired[Mapping[str, JsonValue]]


class GridFields(TypedDict):
    """An ``ElevationGrid`` without its heights, ready for JSON; crs: as WKT."""

    cell_east_m: float
    cell_north_m: float
    origin_east_m: float
    origin_north_m: float
    crs: str | None
    vertical_datum: str | None
    provenance: ProvenanceFields


def grid_fields(grid: ElevationGrid) -> GridFields:
    """What is kept of a grid besides its heights."""
    origin = grid.provenance
    told = ProvenanceFields(
        source=origin.source, driver=origin.driver, conversions=origin.conversions, warnings=origin.warnings
    )
    if origin.overview_of is not None:
        told["overview_of"] = _raster_fields(origin.overview_of)
    return GridFields(
        cell_east_m=grid.cell_east_m,
        cell_north_m=grid.cell_north_m,
        origin_east_m=grid.origin_east_m,
        origin_north_m=grid.origin_north_m,
        crs=None if grid.crs is None else grid.crs.to_wkt(),
        vertical_datum=grid.vertical_datum,
        provenance=told,
    )


def _raster_fields(dem: RasterFile) -> dict[str, JsonValue]:
    return {**asdict(replace(dem, crs=None)), "crs": None if dem.crs is None else dem.crs.to_wkt()}


def _raster_of(fields: Mapping[str, JsonValue]) -> LargeDem:
    arguments: Any = {**fields, "crs": None if fields["crs"] is None else parse_crs(fields["crs"])}
    return LargeDem(**arguments)


def grid_of(heights: Path, fields: GridFields) -> ElevationGrid:
    """The grid again; its heights are mapped into memory, so that all workers share them. Raises OSError."""
    origin = fields["provenance"]
    return ElevationGrid(
        np.load(heights, mmap_mode="r", allow_pickle=False),
        fields["cell_east_m"],
        fields["cell_north_m"],
        fields["origin_east_m"],
        fields["origin_north_m"],
        None if fields["crs"] is None else parse_crs(fields["crs"]),
        fields["vertical_datum"],
        Provenance(
            *(origin["source"], origin["driver"], tuple(origin["conversions"]), tuple(origin["warnings"])),
            overview_of=_raster_of(origin["overview_of"]) if "overview_of" in origin else None,
        ),
    )


def save_grid(grid: ElevationGrid, folder: Path) -> None:
    """Write the grid into a folder, which is made. Raises OSError."""
    folder.mkdir(parents=True)
    np.save(folder / HEIGHTS, grid.heights_m, allow_pickle=False)
    (folder / DESCRIPTION).write_text(json.dumps(grid_fields(grid), allow_nan=False), encoding="utf-8")


def load_grid(folder: Path) -> ElevationGrid:
    """The same grid again, its heights mapped. Raises OSError."""
    return grid_of(folder / HEIGHTS, json.loads((folder / DESCRIPTION).read_text(encoding="utf-8")))


def digest_of_files(folder: Path) -> str:
    """``ElevationGrid.digest`` from the files as they are, with the CRS in the words that PROJ had when it was written.

    Raises OSError, ValueError, KeyError, TypeError where they are damaged.
    """
    described = json.loads((folder / DESCRIPTION).read_text(encoding="utf-8"))
    heights_m = np.load(folder / HEIGHTS, mmap_mode="r", allow_pickle=False)
    names = ("cell_east_m", "cell_north_m", "origin_east_m", "origin_north_m")
    sha = hashlib.sha256(repr((heights_m.shape, *(float(described[name]) for name in names))).encode())
    sha.update((described["crs"] or "local").encode())
    sha.update(heights_m.data)
    return sha.hexdigest()


def is_sound(part: str, path: Path, dem_digests: dict[str, str]) -> bool:
    """Whether a DEM, a result or a job's inputs is there and holds what it held when it was written.

    dem_digests: SHA-256 of each DEM's grid, as the store has it; a result's name says what it holds.
    """
    if not path.is_dir():
        return False
    try:
        if part == "results":
            return digest_of(path) == path.name
        if part == "dems":
            return digest_of_files(path) == dem_digests.get(path.name)
        return any(path.iterdir())
    except (OSError, ValueError, TypeError, KeyError):
        return False


def copy_files(source: Path, target: Path) -> bool:
    """Copy a folder's own files and its notes, without what was drawn; False when it goes away meanwhile, or is gone.

    Raises OSError.
    """
    (target / NOTES).mkdir(parents=True)
    try:
        for path in (*source.iterdir(), *(source / NOTES).glob("*.json")):
            if path.is_file():
                shutil.copyfile(path, target / path.relative_to(source))
    except FileNotFoundError:
        shutil.rmtree(target)
        return False
    make_durable(target)
    return True


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
    cover: NotRequired[CoverFields]


def save(product: Product, finished: Any, folder: Path) -> None:
    """Write a result into a folder, which is made if need be; the description comes last and marks it complete.

    Raises OSError, for instance when the disk is full.
    """
    folder.mkdir(parents=True, exist_ok=True)
    grid = finished.grid
    np.save(folder / "heights_m.npy", grid.heights_m, allow_pickle=False)
    for name in product.arrays:
        array = getattr(finished, name)
        if array is not None:
            np.save(folder / f"{name}.npy", array, allow_pickle=False)
    description: ResultFields = {
        "format": FORMAT,
        "grid": grid_fields(grid),
        "anchor_positions_m": [(a.east_m, a.north_m, a.altitude_m) for a in finished.anchors if isinstance(a, Anchor)],
        "distant_anchors": [_distant_fields(a) for a in finished.anchors if isinstance(a, DistantAnchor)],
        "parameters": finished.parameters.model_dump(mode="json"),
        "cover": save_cover(grid, folder),
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
    bare = grid_of(folder / "heights_m.npy", description["grid"])
    grid = with_kept_cover(bare, folder, description.get("cover", {}))
    finished = product.finished(
        grid=grid,
        anchors=_anchors(grid, parameters, description["anchor_positions_m"], description.get("distant_anchors", ())),
        parameters=parameters,
        answer=_answer(product, folder, summary),
        **{name: mapped_array(folder / f"{name}.npy") for name in product.arrays if _is_kept(product, folder, name)},
    )
    return product, finished


def _is_kept(product: Product, folder: Path, name: str) -> bool:
    """Whether an array is to be read: one that a result may be without is not always there."""
    may_miss = getattr(product.finished, name, name) is None  # the default of a dataclass
    return not may_miss or (folder / f"{name}.npy").is_file()


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
    grid: ElevationGrid, parameters: object, positions_m: Sequence[Sequence[float]], distant: Sequence[DistantFields]
) -> tuple[Anchor | DistantAnchor, ...]:
    if not isinstance(parameters, AskedSources):
        return ()
    heard = isinstance(parameters, SightChoice) and parameters.usable
    near = tuple(
        Anchor(
            *(asked.id, east_m, north_m, altitude_m, asked.ranging_sigma_m, asked.pose_sigma_m),
            limits=asked.antenna_limits(),
            pose_covariance_m2=asked.pose_covariance(),
            radio=asked.radio.radio() if heard and asked.radio is not None else None,
        )
        for asked, (east_m, north_m, altitude_m) in zip(parameters.near_sources(), positions_m, strict=True)
    )
    if isinstance(parameters, DoubtParameters):
        near, _told = doubted_anchors(grid, near, parameters.doubts)
    return (*near, *(DistantAnchor(**fields) for fields in distant))


def _distant_fields(anchor: DistantAnchor) -> DistantFields:
    return DistantFields(
        id=anchor.id,
        azimuth_rad=anchor.azimuth_rad,
        elevation_rad=anchor.elevation_rad,
        range_m=anchor.range_m,
        ranging_sigma_m=anchor.ranging_sigma_m,
    )
