"""What heights count from is told by the name of the vertical datum."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pyproj
import pytest

from terrain import ElevationGrid, HeightReference, height_reference_of, read_dem
from terrain.crs.parts import vertical_part
from tests.terrain.files import hill, write_tif


def reference(datum: str | None, crs: str | None = "EPSG:32632") -> HeightReference:
    return height_reference_of(ElevationGrid(np.zeros((2, 2)), 1.0, 1.0, crs=crs, vertical_datum=datum))


@pytest.mark.parametrize("code", ["EPSG:4979", "EPSG:4937", "EPSG:7843", "EPSG:4957"])
def test_three_dimensional_crss_count_from_their_ellipsoid(code: str) -> None:
    datum, _ = vertical_part(pyproj.CRS.from_user_input(code))
    assert reference(datum) is HeightReference.ELLIPSOID


@pytest.mark.parametrize("code", ["EPSG:9518", "EPSG:5498", "EPSG:7405", "EPSG:5555", "EPSG:7409"])
def test_compound_crss_count_from_a_surface_of_gravity(code: str) -> None:
    datum, _ = vertical_part(pyproj.CRS.from_user_input(code))
    assert reference(datum) is HeightReference.SEA_LEVEL


@pytest.mark.parametrize(
    "datum", ["EGM96 geoid", "EGM2008 geoid", "mean sea level", "NAVD88 height (ftUS)", "LN02 height"]
)
def test_geoids_and_levelling_datums_are_sea_level(datum: str) -> None:
    assert reference(datum) is HeightReference.SEA_LEVEL


@pytest.mark.parametrize("datum", ["ellipsoid of WGS 84", "WGS_1984", "VertCS_WGS_84_ellipsoid", "GRS 1980", "ETRS89"])
def test_ellipsoids_and_geodetic_datums_are_ellipsoids(datum: str) -> None:
    assert reference(datum) is HeightReference.ELLIPSOID


@pytest.mark.parametrize("datum", [None, "", "made up", "local", "/etc/hosts", "+init=epsg:5773"])
def test_anything_else_is_unknown(datum: str | None) -> None:
    assert reference(datum) is HeightReference.UNKNOWN


def test_a_body_without_a_sea_has_no_sea_level() -> None:
    assert reference("mean sea level", "IAU_2015:30110") is HeightReference.UNKNOWN
    assert reference("mean sea level", None) is HeightReference.SEA_LEVEL


@pytest.mark.parametrize(
    ("code", "ellipsoid"),
    [
        (5019, "GRS 1980"),
        (5001, "Airy 1830"),
        (5030, "WGS 84"),
        (5024, "Krassowsky 1940"),
        (5010, "Clarke 1880"),
        (5003, "Australian National"),
    ],
)
def test_the_ellipsoidal_vertical_codes_of_geotiff_1_0_count_from_their_ellipsoid(
    tmp_path: Path, code: int, ellipsoid: str
) -> None:
    # the codes of section 6.3.4.1 of GeoTIFF 1.0, which no writer of today makes: put in place of another
    path = write_tif(tmp_path / "dem.tif", hill(), crs="EPSG:32632+5773")
    entry = struct.pack("<HHHH", 4096, 0, 1, 5773)
    content = path.read_bytes()
    assert content.count(entry) == 1
    path.write_bytes(content.replace(entry, struct.pack("<HHHH", 4096, 0, 1, code)))
    grid = read_dem(path)
    assert height_reference_of(grid) is HeightReference.ELLIPSOID
    assert grid.vertical_datum is not None
    assert ellipsoid in grid.vertical_datum
