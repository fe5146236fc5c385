"""Whether the file of a layer is what its name says, for whatever program reads such files."""

from __future__ import annotations

import csv
import io
import json
import tempfile
import zipfile
from pathlib import PurePath

import gpxpy
import numpy as np
import rasterio
import trimesh
import xarray
from fastkml.kml import KML
from fastkml.validator import validate
from PIL import Image

from service.files.layer import COG, Layer
from tests.service.small_maps import COLS, NORTH_M, ROWS, WEST_M

__all__ = ["assert_opens"]


def assert_opens(layer: Layer, content: bytes) -> None:
    """A file of a layer over the small ground opens as what its suffix and its media type say, and holds something."""
    assert content, layer.name
    OPENED[PurePath(layer.name).suffix](layer.name, content)
    if layer.name.endswith(".tif"):  # in a cloud-optimised one GDAL tells the layout ahead of all else
        assert (b"LAYOUT=IFDS_BEFORE_DATA" in content[:400]) == (layer.media_type == COG), layer.name


def _picture(name: str, content: bytes) -> None:
    with Image.open(io.BytesIO(content)) as picture:
        assert picture.format == PurePath(name).suffix[1:].upper()
        if name == "overlay.png":  # a pixel for each post, to be laid over a map
            assert picture.mode == "RGBA"
        else:
            assert min(picture.size) > (200 if name.startswith("cut-") else 400), name
            assert len(set(picture.convert("RGB").resize((200, 150)).get_flattened_data())) > 50, name


def _raster(name: str, content: bytes) -> None:
    with rasterio.MemoryFile(content) as file, file.open() as dataset:
        assert (dataset.height, dataset.width, dataset.crs.to_epsg()) == (ROWS, COLS, 32611), name
        assert np.allclose(dataset.xy(0, 0), (WEST_M, NORTH_M), atol=1e-3), name
        assert dataset.read().size == dataset.count * ROWS * COLS
        assert dataset.tags()["version"]


def _json(name: str, content: bytes) -> None:
    assert json.loads(content, parse_constant=lambda word: 1 / 0), name


def _geojson(name: str, content: bytes) -> None:
    document = json.loads(content)
    assert document["type"] == "FeatureCollection", name
    assert {feature["type"] for feature in document["features"]} <= {"Feature"}


def _table(name: str, content: bytes) -> None:
    head, *rows = csv.reader(io.StringIO(content.decode(), newline=""))
    assert rows, name
    assert {len(row) for row in rows} == {len(head)}, name


def _arrays(name: str, content: bytes) -> None:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        assert len([arrays[one] for one in arrays.files]) > 2, name


def _archive(name: str, content: bytes) -> None:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.namelist(), name
        for plan in archive.namelist():
            _mission(plan, archive.read(plan))


def _mission(name: str, content: bytes) -> None:
    plan = json.loads(content)
    assert (plan["fileType"], plan["version"]) == ("Plan", 1), name
    assert plan["mission"]["items"], name


def _track(name: str, content: bytes) -> None:
    assert len(gpxpy.parse(content.decode()).tracks[0].segments[0].points) > 1, name


def _placemarks(name: str, content: bytes) -> None:
    document = KML.from_string(content)
    assert validate(element=document.etree_element()), name  # against the OGC's schema
    (told,) = document.features
    assert [mark for folder in told.features for mark in folder.features], name


def _volume(name: str, content: bytes) -> None:
    with tempfile.NamedTemporaryFile(suffix=".nc") as file:
        file.write(content)
        file.flush()
        with xarray.open_dataset(file.name) as dataset:
            assert "dop" in dataset, name


def _mesh(name: str, content: bytes) -> None:
    assert trimesh.load(io.BytesIO(content), file_type=PurePath(name).suffix[1:]).bounds.shape == (2, 3), name


def _parameters(name: str, content: bytes) -> None:
    assert [line for line in content.decode().splitlines() if not line.startswith("#")], name


OPENED = {
    **{".png": _picture, ".gif": _picture, ".tif": _raster, ".json": _json, ".geojson": _geojson, ".csv": _table},
    **{".npz": _arrays, ".zip": _archive, ".plan": _mission, ".gpx": _track, ".nc": _volume, ".parm": _parameters},
    **{".glb": _mesh, ".stl": _mesh, ".kml": _placemarks},
}
