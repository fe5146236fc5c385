"""Places out of ECEF positions, against PROJ."""

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss import GnssInputError, Place, place_ecef_m
from gnss.sky import place_of_ecef

TO_DEGREES = pyproj.Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)


@given(
    st.floats(-179.9, 179.9),
    st.floats(-90.0, 90.0),
    st.floats(-5_000.0, 50_000.0),
)
def test_a_place_comes_back(lon_deg, lat_deg, height_m):
    position_m = place_ecef_m(Place(lon_deg, lat_deg, height_m))
    found = place_of_ecef(position_m)
    assert found.height_m == pytest.approx(height_m, abs=1e-6)
    np.testing.assert_allclose(place_ecef_m(found), position_m, rtol=0.0, atol=1e-6)
    lon, lat, height = TO_DEGREES.transform(*position_m)
    assert found.lat_deg == pytest.approx(lat, abs=1e-9)
    assert found.height_m == pytest.approx(height, abs=1e-3)  # PROJ takes one step only
    if abs(lat_deg) < 89.99:
        assert found.lon_deg == pytest.approx(lon, abs=1e-8)


@pytest.mark.parametrize("position", [(0.0, 0.0, 0.0), (np.nan, 0.0, 7e6), (1.0, 2.0)])
def test_what_is_no_place_is_refused(position):
    with pytest.raises(GnssInputError):
        place_of_ecef(position)
