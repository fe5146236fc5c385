"""Heights of the EGM96 geoid, against what its makers and others published."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from terrain import VerticalDatumError, egm96_height_m
from terrain.datums import geoid
from terrain.datums.packing import pack, unpack

# (lat_deg, lon_deg, metres). The first six: NGA's OUTINTPT.DAT, which comes with its grid and program INTPT.F.
NGA = (
    (38.6281550, 269.7791550, -31.628),
    (-14.6212170, 305.0211140, -2.969),
    (46.8743190, 102.4487290, -43.575),
    (-23.6174460, 133.8747120, 15.871),
    (38.6254730, 359.9995000, 50.066),
    (-0.4667440, 0.0023000, 17.329),
)
# the same places by NGA's F477, which sums the spherical harmonics of the model itself
HARMONICS = (-31.629, -2.966, -43.572, 15.868, 50.065, 17.330)
# GeographicLib's GeoidEval with its 5' grid of EGM96: as in Orekit's tests, and Timbuktu as in its announcement
GEOGRAPHICLIB = (
    (0.0, 75.0, -100.3168),
    (-30.0, 60.0, 14.9214),
    (0.0, 130.0, 76.6053),
    (60.0, -30.0, 63.7979),
    (40.0, -75.0, -34.0402),
    (28.0, 92.0, -30.4056),
    (45.0, 250.0, -7.4825),
    (16.0 + 46.0 / 60.0 + 33.0 / 3600.0, -3.0 - 34.0 / 3600.0, 28.7068),
)
POLES = ((90.0, 0.0, 13.606), (90.0, -77.0, 13.606), (-90.0, 123.0, -29.534))


@pytest.mark.parametrize(("lat_deg", "lon_deg", "published_m"), [*NGA, *GEOGRAPHICLIB, *POLES])
def test_published_heights_are_met_to_a_centimetre(lat_deg: float, lon_deg: float, published_m: float) -> None:
    assert float(egm96_height_m(lon_deg, lat_deg)) == pytest.approx(published_m, abs=0.01)


def test_the_model_itself_is_met_to_a_centimetre() -> None:
    lat_deg, lon_deg, _ = np.array(NGA).T
    assert np.abs(egm96_height_m(lon_deg, lat_deg) - HARMONICS).max() < 0.01


def test_the_globe_has_no_seam() -> None:
    lat_deg = np.linspace(-90.0, 90.0, 1441)
    for west in (-180.0, 0.0, 359.999_999):
        at, after = egm96_height_m(west, lat_deg), egm96_height_m(west + 1e-6, lat_deg)
        assert np.abs(at - after).max() < 1e-4
    assert np.abs(egm96_height_m(-180.0, lat_deg) - egm96_height_m(180.0, lat_deg)).max() == 0.0
    over = egm96_height_m(np.array([10.0, 190.0]), np.array([89.999_99, 89.999_99]))
    assert abs(over[0] - over[1]) < 1e-3


def test_arrays_keep_their_shape() -> None:
    lon_deg, lat_deg = np.meshgrid(np.linspace(-170.0, 170.0, 5), np.linspace(-80.0, 80.0, 3))
    heights_m = egm96_height_m(lon_deg, lat_deg)
    assert heights_m.shape == (3, 5)
    assert heights_m[2, 1] == egm96_height_m(lon_deg[2, 1], lat_deg[2, 1])


@pytest.mark.parametrize("place", [(0.0, 91.0), (np.nan, 0.0), (0.0, np.inf)])
def test_what_are_no_degrees_is_refused(place: tuple[float, float]) -> None:
    with pytest.raises(VerticalDatumError, match="latitudes of −90…90"):
        egm96_height_m(*place)


def test_the_grid_is_the_one_that_its_description_names() -> None:
    described = geoid.GRID.with_name("egm96.md").read_text(encoding="utf-8")
    assert hashlib.sha256(geoid.GRID.read_bytes()).hexdigest() == geoid.GRID_SHA256
    assert geoid.GRID_SHA256 in described
    assert geoid.GRID.stat().st_size < 1.5e6


def test_a_damaged_grid_is_refused(tmp_path, monkeypatch) -> None:
    damaged = tmp_path / "egm96.npz"
    damaged.write_bytes(geoid.GRID.read_bytes()[:-1])
    monkeypatch.setattr(geoid, "GRID", damaged)
    geoid._spline.cache_clear()
    with pytest.raises(VerticalDatumError, match="is damaged"):
        egm96_height_m(0.0, 0.0)
    geoid._spline.cache_clear()


def test_what_is_packed_comes_back_to_half_a_centimetre(tmp_path) -> None:
    heights_m = np.cumsum(np.random.default_rng(3).normal(0.0, 2.0, (40, 50)), axis=1)
    pack(heights_m, tmp_path / "grid.npz")
    assert np.abs(unpack(tmp_path / "grid.npz") - heights_m).max() <= 0.005 + 1e-9
    with pytest.raises(ValueError, match="differ by more"):
        pack(heights_m * 1000.0, tmp_path / "grid.npz")
