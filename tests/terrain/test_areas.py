"""Areas: what they hold in which frame, and what is no area."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pyproj
import pytest
import shapely

from terrain import AreaError, Box, Circle, ElevationGrid, FrameError, Outline, area_in, area_window
from terrain.areas import area_in_degrees, grown_area

UTM = pyproj.CRS.from_epsg(32632)
MOON = pyproj.CRS.from_proj4("+proj=aeqd +lat_0=-85 +lon_0=30 +R=1737400 +units=m")


def grid() -> ElevationGrid:
    return ElevationGrid(np.zeros((101, 201), np.float32), 10.0, 10.0, 500_000.0, 5_000_000.0, crs=UTM)


def test_a_box_in_metres_is_itself_and_its_window_encloses_it() -> None:
    box = Box(500_104.0, 4_999_501.0, 500_255.0, 4_999_650.0, frame="EPSG:32632")
    assert area_in(box, UTM).bounds == (500_104.0, 4_999_501.0, 500_255.0, 4_999_650.0)
    assert area_window(grid(), box) == (35, 50, 10, 26)
    assert area_window(grid(), Box(500_104.0, 4_999_501.0, 500_255.0, 4_999_650.0, frame="metres")) == (35, 50, 10, 26)


@pytest.mark.parametrize("crs", [UTM, MOON], ids=["Earth", "Moon"])
def test_a_circle_in_degrees_has_its_radius_over_ground(crs: pyproj.CRS) -> None:
    lon, lat = (9.2, 45.1) if crs is UTM else (31.0, -84.9)
    ring = area_in(Circle(lon, lat, 2000.0), crs)
    east, north = pyproj.Transformer.from_crs(
        pyproj.CRS.from_epsg(4326) if crs is UTM else crs.geodetic_crs, crs, always_xy=True
    ).transform(lon, lat)
    distance_m = [math.dist((east, north), corner) for corner in ring.exterior.coords]
    assert min(distance_m) >= 1998.0
    assert max(distance_m) <= 2002.0
    assert ring.area == pytest.approx(math.pi * 2000.0**2, rel=2e-3)


def test_a_circle_in_metres_holds_all_within_its_radius() -> None:
    ring = area_in(Circle(500_500.0, 4_999_500.0, 300.0, frame="metres"), UTM)
    angle = np.linspace(0.0, 2.0 * np.pi, 1000)
    shapely.prepare(ring)
    assert shapely.contains_xy(ring, 500_500.0 + 299.999 * np.cos(angle), 4_999_500.0 + 299.999 * np.sin(angle)).all()
    assert ring.area == pytest.approx(math.pi * 300.0**2, rel=1e-3)


def test_sides_of_a_box_in_degrees_follow_meridians_and_parallels() -> None:
    box = area_in(Box(6.0, 45.0, 12.0, 46.0), UTM)
    bulge = pyproj.Transformer.from_crs(4326, UTM, always_xy=True).transform(9.0, 45.0)[1]
    assert box.bounds[1] == pytest.approx(bulge, abs=20.0), "the parallel dips in the middle of the zone"


def test_a_margin_is_a_distance_over_ground() -> None:
    grown = area_in(grown_area(Box(9.0, 45.0, 9.1, 45.1), 500.0), UTM)
    before = area_in(Box(9.0, 45.0, 9.1, 45.1), UTM)
    assert grown.bounds == pytest.approx(before.buffer(500.0).bounds, abs=2.0)


def test_over_the_antimeridian_a_box_and_a_ring_take_the_short_way() -> None:
    assert area_in_degrees(Box(179.0, -17.0, -179.0, -16.0)).area == pytest.approx(2.0)
    ring = Outline(((179.0, -17.0), (-179.0, -17.0), (-179.0, -16.0), (179.0, -16.0)))
    assert area_in_degrees(ring).area == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Box(1.0, 2.0, 3.0, 2.0), "is empty: south must lie below north"),
        (lambda: Box(1.0, 2.0, math.nan, 3.0), "must be finite numbers"),
        (lambda: Box(500_000.0, 4e6, 501_000.0, 5e6), "Are they swapped, or metres"),
        (lambda: Box(5.0, 0.0, 1.0, 9.0, frame="metres"), "is empty"),
        (lambda: Circle(1.0, 2.0, 0.0), "must be more than 0 m"),
        (lambda: Circle(1.0, 95.0, 10.0), "latitudes in −90…90"),
        (lambda: Outline(((0.0, 0.0), (1.0, 1.0))), "at least three corners"),
        (lambda: Outline(((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))), "no polygon: Self-intersection"),
        (lambda: area_in(Circle(0.0, 89.99, 5000.0), UTM), "holds a pole"),
        (lambda: area_window(grid(), Box(0.0, 0.0, 5.0, 5.0, frame="metres")), "lies beside the DEM"),
    ],
)
def test_what_is_no_area_is_refused(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(AreaError, match=sentence):
        make()


def test_degrees_have_no_place_in_a_local_frame_nor_a_dems_metres_on_earth() -> None:
    with pytest.raises(FrameError, match="must be in its metres"):
        area_in(Box(9.0, 45.0, 9.1, 45.1), None)
    with pytest.raises(FrameError, match="name the CRS of its metres"):
        area_in_degrees(Box(0.0, 0.0, 5.0, 5.0, frame="metres"))
