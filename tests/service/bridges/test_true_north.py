"""What leaves for an autopilot counts from true north, whatever the anchors' frame is."""

from __future__ import annotations

import math

import numpy as np
import pyproj
import pytest

from detection import RangingAnchor
from gnss import Place
from service.live.bridges.true_north import GridFrame, LocalFrame, origin_of
from terrain import ElevationGrid

EARTH = pyproj.Geod(ellps="WGS84")
# the anchors of a placement over a UTM grid whose north is 1.42 degrees off the meridian: id, lon, lat, east, north
GRID = [
    ("P1", 10.955655699816226, 46.38076139224386),
    ("P2", 10.939295440313531, 46.359440111431056),
    ("P3", 10.954500135325011, 46.34838111655986),
    ("P4", 10.940442461324622, 46.39182061694004),
]


def test_offsets_from_a_grid_are_turned_to_true_north():
    to_grid = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True)
    places = {name: to_grid.transform(lon_deg, lat_deg) for name, lon_deg, lat_deg in GRID}
    anchors = [RangingAnchor(name, *places[name], 1100.0) for name in places]
    east_m, north_m = places["P2"]
    grid = ElevationGrid(np.zeros((2, 2), np.float32), 5000.0, 5000.0, east_m, north_m + 4000.0, crs="EPSG:32632")
    origin = origin_of(GridFrame(grid), anchors, ellipsoid=False)
    for name, lon_deg, lat_deg in GRID:
        azimuth_deg, _, way_m = EARTH.inv(origin.lon_deg, origin.lat_deg, lon_deg, lat_deg)
        told_m = origin.ned_m((*places[name], 1100.0))
        true_m = way_m * math.cos(math.radians(azimuth_deg)), way_m * math.sin(math.radians(azimuth_deg))
        assert math.dist(told_m[:2], true_m) < 0.01
        along_grid_m = places[name][1] - origin.at_m[1], places[name][0] - origin.at_m[0]
        assert math.dist(along_grid_m, true_m) > 15.0, "so far off it is without"
    # sigma along the grid's east is told along where that lies
    covariance = origin.ned_covariance_m2(np.diag([4.0, 1.0, 9.0]))
    turn_rad = origin.frame.turn_rad()
    assert math.degrees(turn_rad) == pytest.approx(1.42, abs=0.03)
    along_east = np.array([-math.sin(turn_rad), math.cos(turn_rad), 0.0])
    assert along_east @ covariance @ along_east == pytest.approx(4.0)
    assert covariance[2, 2] == pytest.approx(9.0)


def test_degrees_come_back_as_they_were_given():
    frame = LocalFrame(Place(10.94, 46.37, 1000.0))
    for lon_deg, lat_deg, altitude_m in ((10.95, 46.38, 1200.0), (10.90, 46.36, 900.0)):
        place_m = frame.place(lon_deg, lat_deg, altitude_m)
        assert frame.degrees(*place_m) == pytest.approx((lon_deg, lat_deg), abs=1e-9)
