"""Whatever happened to a file of any kind that is taken, reading it ends well or in one sentence, in little memory.

SIGHTLINE_FUZZ sets how many damaged files of each kind, 10 times over; before a release it is 100, which makes more
than ten thousand.
"""

from __future__ import annotations

import json
import os
import resource
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.shutil
import trimesh

from detection import DetectionError
from gnss import GnssError, parse_almanac, parse_rinex_navigation
from service.cli.asking.anchor_files import anchors_from_file, tracks_from_file
from service.cli.asking.path_files import PLANNED, path_from_file, place_fields, polygon_fields, trajectory_from_file
from service.errors import ServiceError
from service.live.epoch_logs import read_epochs
from terrain import ElevationGrid, TerrainError, read_dem, write_npz
from tests.fuzzing.mutations import damaged
from tests.service.logs.recorded import RECORDED
from tests.service.skies import almanac
from tests.terrain.files import UTM_32N, hill, write_asc, write_tif
from tests.visibility.meshes import box, level
from tests.visibility.satellites.test_almanac_files import YUMA
from visibility import VisibilityError
from visibility.cover import parse_buildings

EACH = 10 * int(os.environ.get("SIGHTLINE_FUZZ", "4"))
GIB = 1024**3
REFUSALS = (TerrainError, GnssError, VisibilityError, ServiceError, DetectionError)

ANCHORS = [{"id": f"D{n}", "east_m": 10.0 * n, "north_m": -5.5 * n, "altitude_m": 40.0} for n in range(4)]
POLYGON = {"type": "Polygon", "coordinates": [[[7.0, 46.0], [7.1, 46.0], [7.1, 46.1], [7.0, 46.0]]]}
POINT = {
    "type": "Feature",
    "properties": {"id": "D1", "altitude_m": 3.0},
    "geometry": {"type": "Point", "coordinates": [7, 46]},
}


def collection(*features: Any) -> bytes:
    return json.dumps({"type": "FeatureCollection", "features": features}).encode()


def rinex() -> bytes:
    """Two records of a made-up navigation file, version 2."""
    head = f"{2.0:9.2f}{'':11}{'N: GPS NAV DATA':<40}RINEX VERSION / TYPE\n{'':60}END OF HEADER\n"
    orbit = [10.0, 5.0, 4.5e-9, 0.5, 1e-6, 0.01, 8e-6, 5153.7, 540000.0, 1e-7, 1.0, 1e-7, 0.96, 200.0, 0.6, -8e-9]
    orbit += [1e-10, 1.0, 1411.0, 0.0, 2.0, 0.0, -1e-8, 10.0, 540000.0, 4.0, 0.0, 0.0]
    text = head
    for prn in (1, 2):
        text += f"{prn:2d} 07  1 27  6  0  0.0" + "".join(f"{value:19.12E}" for value in (1e-5, 1e-12, 0.0)) + "\n"
        for row in range(7):
            text += "   " + "".join(f"{value:19.12E}" for value in orbit[4 * row : 4 * row + 4]) + "\n"
    return text.encode()


def dem_bytes(path: Path, make: Callable[[Path], Any]) -> bytes:
    make(path)
    return path.read_bytes()


def hgt(path: Path) -> None:
    path.write_bytes((np.arange(1201 * 1201) % 3000).astype(">i2").tobytes())


def dted(path: Path) -> None:
    heights = (np.arange(1201 * 1201) % 3000).astype("i2").reshape(1201, 1201)
    transform = rasterio.Affine(1 / 1200, 0, 7 - 1 / 2400, 0, -1 / 1200, 47 + 1 / 2400)
    source = write_tif(path.with_suffix(".tif"), heights, crs="EPSG:4326", transform=transform, nodata=-32767)
    with rasterio.open(source) as opened:
        rasterio.shutil.copy(opened, path, driver="DTED")


def degrees(path: Path) -> None:
    write_tif(path, hill().astype("i2"), crs="EPSG:4326", transform=rasterio.Affine(0.001, 0, 11.9, 0, -0.001, 47))


DEMS: dict[str, Callable[[Path], Any]] = {
    "plain.tif": lambda path: write_tif(path, hill()),
    "tiled.tif": lambda path: write_tif(
        path, np.tile(hill(), (6, 6)), compress="deflate", tiled=True, blockxsize=32, blockysize=32
    ),
    "degrees.tif": degrees,
    "scaled.tif": lambda path: write_tif(path, hill().astype("i2"), scales=[0.1], offsets=[10.0], units=["ft"]),
    "text.asc": lambda path: write_asc(path, hill(), nodata=-9999),
    "N46E007.hgt": hgt,
    "n46_e007.dt1": dted,
    "own.npz": lambda path: write_npz(ElevationGrid(hill(), 10.0, 10.0, 5e5, 5e6, UTM_32N), path),
    "plain.npz": lambda path: np.savez(path, heights_m=hill(), cell_east_m=1.0, cell_north_m=1.0, crs_wkt=UTM_32N),
    "bare.npy": lambda path: np.save(path, hill()),
}
LOG = b"time_s,anchor_id,range_m,duration_s,wheel_x_m,wheel_y_m\n0,D1,10.5,,,\n0,D2,20.5,,,\n1,,,1,0.5,0.1\n"
WIDE_LOG = b"time_s,range_m.D1,range_m.D2,duration_s,wheel_x_m,wheel_y_m\n0,1.5,2.5,,,\n1,1.6,nan,1,0.1,0.2\n"
MESSAGES = b'{"time_s": 1.0, "ranges": [{"anchor_id": "D1", "range_m": 3.5}]}\n{"time_s": 2.0, "ranges": []}\n'
CSV_ANCHORS = b"id,east_m,north_m,altitude_m\nD1,1,2,3\nD2,4,5,6\n"
TRACKS = b"id,time_s,east_m,north_m,altitude_m\nA,0,1,2,3\nA,10,4,5,6\n"
JSON_TRACKS = json.dumps(
    [{"id": "A", "points": [{"time_s": 0.0, **{k: v for k, v in ANCHORS[1].items() if k != "id"}}]}]
)


def read_sky(path: Path) -> Any:
    return parse_almanac(path.read_bytes().decode("utf-8", "replace"), reference=date(2007, 1, 22))


PLAN = f"{','.join(sorted(PLANNED))}\n{','.join('1' * len(PLANNED))}\n"
OTHERS: dict[str, tuple[bytes, Callable[[Path], Any]]] = {
    "log.csv": (LOG, read_epochs),
    "wide.csv": (WIDE_LOG, read_epochs),
    "messages.jsonl": (MESSAGES, read_epochs),
    "anchors.csv": (CSV_ANCHORS, anchors_from_file),
    "anchors.json": (json.dumps(ANCHORS).encode(), anchors_from_file),
    "anchors.geojson": (collection(POINT), anchors_from_file),
    "tracks.csv": (TRACKS, tracks_from_file),
    "tracks.json": (JSON_TRACKS.encode(), tracks_from_file),
    "path.csv": (b"east_m,north_m,altitude_m\n1,2,3\n4,5,6\n", lambda path: path_from_file(path, 1.5)),
    "planned.csv": (PLAN.encode(), lambda path: trajectory_from_file(path, "1.5agl")),
    "areas.geojson": (collection({"type": "Feature", "geometry": POLYGON, "properties": {}}), polygon_fields),
    "places.geojson": (collection(POINT), place_fields),
    "current.alm": (almanac(4).encode(), read_sky),
    "yuma.alm": (YUMA.encode(), read_sky),
    "brdc.nav": (rinex(), lambda path: parse_rinex_navigation(path.read_bytes().decode("utf-8", "replace"))),
}
MESHES = ("binary.stl", "text.stl", "city.obj", "binary.ply", "text.ply", "city.glb")


def mesh_bytes(name: str) -> bytes:
    mesh, suffix = box(100, -100), name.rsplit(".", 1)[1]
    kind = {"text.stl": "stl_ascii"}.get(name, suffix)
    more = {"encoding": "ascii"} if name == "text.ply" else {}
    made = (
        mesh.export(file_type=kind, **more)
        if suffix != "glb"
        else trimesh.Scene([mesh, box(10, -10)]).export(file_type="glb")
    )
    return made.encode() if isinstance(made, str) else made


@pytest.fixture
def little_memory() -> Iterator[None]:
    """No more than two GiB besides what the process has: a small file has no use for it."""
    with Path("/proc/self/statm").open(encoding="ascii") as file:
        used_bytes = int(file.read().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used_bytes + 2 * GIB, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def read_damaged(path: Path, whole: bytes, read: Callable[[Path], Any]) -> int:
    """How many of the damaged files were refused; each in one sentence."""
    refused = 0
    for number in range(EACH):
        path.write_bytes(damaged(whole, f"{path.name} {number}"))
        try:
            read(path)
        except REFUSALS as error:
            refused += 1
            sentence = str(error)
            assert sentence.strip().endswith((".", "?")), (number, sentence)
            assert "\n" not in sentence, (number, sentence)
            sentence.encode()  # what is said can be sent
        except Exception as error:
            raise AssertionError(f"{path.name} {number}: {error!r}") from error
    return refused


# rasterio cannot decode GDAL's log lines that quote damaged bytes; it says so and goes on
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", DEMS)
def test_a_damaged_dem_is_read_or_refused(tmp_path: Path, little_memory: None, name: str) -> None:
    whole = dem_bytes(tmp_path / name, DEMS[name])
    options = {"cell_m": 1.0} if name == "bare.npy" else {}
    read_dem(tmp_path / name, **options)
    assert read_damaged(tmp_path / name, whole, lambda path: read_dem(path, max_cells=2_000_000, **options)) > 0


@pytest.mark.filterwarnings("ignore")  # of numpy and trimesh, about numbers that are none
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", MESHES)
def test_a_damaged_mesh_is_read_or_refused(tmp_path: Path, little_memory: None, name: str) -> None:
    whole, ground = mesh_bytes(name), level()
    assert len(parse_buildings(whole, name, ground).faces) >= 12

    def read(path: Path) -> Any:
        return parse_buildings(path.read_bytes(), path.name, ground, heights="absolute")

    assert read_damaged(tmp_path / name, whole, read) > 0


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", OTHERS)
def test_any_other_damaged_file_is_read_or_refused(tmp_path: Path, little_memory: None, name: str) -> None:
    whole, read = OTHERS[name]
    (tmp_path / name).write_bytes(whole)
    assert read(tmp_path / name)
    assert read_damaged(tmp_path / name, whole, read) > 0


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", RECORDED)
def test_a_damaged_recording_is_read_or_refused(
    tmp_path: Path, little_memory: None, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    path = RECORDED[name](tmp_path / "log")
    path = next(path.glob("*.[dm][bc]*")) if path.is_dir() else path
    assert read_epochs(path).epochs
    read_damaged(path, path.read_bytes(), read_epochs)
    assert capfd.readouterr() == ("", "")
