"""Radios and canopy in requests: what is usable in place of visible, and what cannot be asked."""

from __future__ import annotations

import base64
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import rasterio
from affine import Affine
from pydantic import ValidationError

from service.jobs.kept_files import load, save
from service.parts.cover import CoverParameters, covered
from service.parts.radios import RadioIn
from service.parts.unused import notes_on_unused
from service.probes.places import probe
from service.probes.profiles import profiles
from service.probes.request import ProbeIn, ProfilesIn
from service.products import Work
from service.products.registry import PRODUCTS
from terrain import ElevationGrid, height_at
from tests.service.asked import ASKED
from tests.service.small_maps import small_grid
from tests.service.small_paths import at
from tests.service.test_cover_of_products import COVER, footprints
from tests.terrain.files import write_tif
from visibility import VISIBLE, CoverError
from visibility.signal import RADIOS, margin_map, signals

CANOPY: dict[str, Any] = {"top_m": 18.0, "base_m": 2.0, "model": "density", "depth_per_m": 0.05}
WHY = "this answer is of what is in sight, not of what is usable"
ENDS = [{**at(95.0, 229.0), "above_ground_m": 5.0}, {**at(330.0, 229.0), "above_ground_m": 2.0}]


def anchors(radio: dict[str, Any] | None) -> list[dict[str, Any]]:
    return [{**one, "radio": radio} for one in ASKED["visibility-map"]["anchors"]]


def finished(name: str, **changes: Any) -> Any:
    product = PRODUCTS[name]
    parameters = product.parameters.model_validate({**ASKED[name], **changes})
    return product.calculate(covered(small_grid(), parameters), parameters, Work())


def test_a_usable_map_is_where_the_margin_of_links_is_not_negative() -> None:
    radio = {"preset": "868MHz", "sensitivity_dbm": -85.0}
    found = finished("visibility-map", anchors=anchors(radio), sight="usable", cover={"canopy": CANOPY})
    grid = covered(small_grid(), CoverParameters.model_validate({"cover": {"canopy": CANOPY}}))
    budget = replace(RADIOS["868MHz"], sensitivity_dbm=-85.0)
    shares = []
    for number, anchor in enumerate(found.anchors):
        margin_db, _ = margin_map(grid, anchor, budget, grid.heights_m + np.float32(1.5))
        np.testing.assert_allclose(found.margin_db[number], margin_db)
        within = found.visible[number] == VISIBLE
        assert not (within & ~(margin_db >= 0.0)).any()
        shares.append(within.mean())
    assert 0.0 < max(shares) < 1.0
    # behind a hill a good radio is heard, and in a forest a weak one is not
    strong = finished("visibility-map", anchors=anchors({"preset": "915MHz"}), sight="usable")
    seen = finished("visibility-map")
    assert (strong.visible == VISIBLE).sum() > (seen.visible == VISIBLE).sum()


def test_radios_are_not_looked_at_for_what_is_visible() -> None:
    with_radios = finished("visibility-map", anchors=anchors({"preset": "uwb"}))
    np.testing.assert_array_equal(with_radios.visible, finished("visibility-map").visible)
    assert with_radios.margin_db is None


@pytest.mark.parametrize("name", sorted(name for name, asked in ASKED.items() if asked.get("anchors")))
def test_radios_that_are_not_looked_at_are_told(name: str) -> None:
    model = PRODUCTS[name].parameters
    silent = model.model_validate(ASKED[name])
    lists = [one for one in ("anchors", "tracks") if ASKED[name].get(one)]
    radios = {one: [{**anchor, "radio": "uwb"} for anchor in ASKED[name][one]] for one in lists}
    names = ", ".join(anchor["id"] for one in lists for anchor in ASKED[name][one])
    assert notes_on_unused(small_grid(), silent) == []
    told = notes_on_unused(small_grid(), model.model_validate({**ASKED[name], **radios}))
    assert told == [f"Not looked at: the radio of {names}, since {WHY}."]


def test_a_canopy_is_told_where_nothing_is_asked_as_usable() -> None:
    model = PRODUCTS["visibility-map"].parameters
    asked = {**ASKED["visibility-map"], "anchors": anchors({"preset": "uwb"}), "cover": {"canopy": CANOPY}}
    seen, usable = (model.model_validate({**asked, "sight": sight}) for sight in ("visible", "usable"))
    grid = covered(small_grid(), seen)
    assert notes_on_unused(grid, seen)[1:] == [f"Not looked at: the canopy, since {WHY}; trees hide nothing."]
    assert notes_on_unused(grid, usable) == []


@pytest.mark.parametrize("name", ["dop-map", "morphing-map"])
def test_dilution_and_morphing_maps_may_be_of_what_is_usable(name: str) -> None:
    standing: dict[str, Any] = {"tracks": [], "frames": None} if name == "morphing-map" else {}
    asked = [{**one, "radio": {"preset": "915MHz"}} for one in ASKED[name]["anchors"]]
    seen, usable = finished(name, **standing), finished(name, anchors=asked, sight="usable", **standing)
    silent = [{**one, "radio": {"preset": "915MHz", "sensitivity_dbm": 0.0}} for one in asked]
    unheard = finished(name, anchors=silent, sight="usable", **standing)
    answers = [one.answer.model_dump(exclude={"timing", "parameters"}) for one in (seen, usable, unheard)]
    assert answers[0] != answers[1] != answers[2]


@pytest.mark.parametrize(
    ("radio", "sentence"),
    [
        ({"frequency_hz": 868e6}, "needs transmit_power_dbm, sensitivity_dbm"),
        ({"preset": "uwb", "frequency_hz": 1e6}, "frequency_hz must lie between"),
        ({"preset": "uhf"}, "Input should be"),
    ],
)
def test_a_radio_that_is_none_is_refused(radio: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        RadioIn.model_validate(radio)


def test_a_probe_tells_the_signal_and_counts_who_is_usable() -> None:
    body = {
        "dem_id": "dem",
        "points": [at(330.0, 229.0)],
        "anchors": anchors({"preset": "868MHz", "sensitivity_dbm": 0.0}),
        "cover": {"canopy": CANOPY},
    }
    grid = covered(small_grid(), CoverParameters.model_validate({"cover": body["cover"]}))
    visible, usable = (probe(grid, ProbeIn.model_validate({**body, "sight": sight})) for sight in ("visible", "usable"))
    assert visible.points[0].visible_anchors >= 1
    assert usable.points[0].visible_anchors == 0
    for seen, told in zip(visible.points[0].anchors, usable.points[0].anchors, strict=True):
        assert seen.signal == told.signal
        assert told.signal is not None
        assert told.signal.margin_db is None or told.signal.margin_db < 0.0


def test_a_profile_shows_roofs_crowns_zone_and_signal() -> None:
    body = {
        "dem_id": "dem",
        "pairs": [dict(zip(("from", "to"), ENDS, strict=True))],
        "radio": {"preset": "868MHz"},
        "cover": {"footprints": {"geojson": footprints()}, "canopy": CANOPY},
    }
    asked = ProfilesIn.model_validate(body)
    grid = covered(small_grid(), asked)
    told = profiles(grid, asked).profiles[0]
    ground_m = np.array(told.ground_m, float)
    np.testing.assert_allclose(np.array(told.canopy_top_m, float), ground_m + 18.0, atol=2e-3)
    np.testing.assert_allclose(np.array(told.canopy_base_m, float), ground_m + 2.0, atol=2e-3)
    roofs = [value for value in told.roof_m if value is not None]
    assert roofs
    assert len(roofs) < len(told.roof_m)
    assert told.fresnel_radius_m is not None
    ends_m = [grid_point(grid, end) for end in ENDS]
    wanted = signals(grid, [ends_m[0]], [ends_m[1]], RADIOS["868MHz"])
    assert told.signal.margin_db == pytest.approx(wanted.margin_db[0])
    bare = profiles(small_grid(), ProfilesIn.model_validate({"dem_id": "dem", "pairs": body["pairs"]})).profiles[0]
    assert (bare.roof_m, bare.canopy_top_m, bare.signal, bare.fresnel_radius_m) == (None, None, None, None)


def grid_point(grid: ElevationGrid, end: dict[str, Any]) -> tuple[float, float, float]:
    ground_m = float(height_at(grid, end["east_m"], end["north_m"]))
    return end["east_m"], end["north_m"], ground_m + end["above_ground_m"]


def raster(tmp_path: Path, heights_m: Any, every: int = 1) -> dict[str, str]:
    """A GeoTIFF over the small ground, of every so many posts, as a request carries one."""
    grid = small_grid()
    east_m, north_m = grid.cell_east_m * every, grid.cell_north_m * every
    corner = Affine(east_m, 0.0, grid.origin_east_m - east_m / 2, 0.0, -north_m, grid.origin_north_m + north_m / 2)
    values = np.broadcast_to(np.float32(heights_m), grid.shape)[::every, ::every]
    path = write_tif(tmp_path / "raster.tif", values, crs="EPSG:32611", transform=corner)
    return {"name": path.name, "base64": base64.b64encode(path.read_bytes()).decode()}


def test_a_canopy_in_a_file_of_other_posts_is_resampled_and_told(tmp_path: Path) -> None:
    grid = small_grid()
    heights = raster(tmp_path, 12.0, every=2)
    built = covered(grid, CoverParameters.model_validate({"cover": {"canopy": {"heights": heights}}}))
    assert built.trees is not None
    assert np.nanmax(built.trees.top_m) == pytest.approx(12.0)
    assert any("resampled to the DEM's" in note for note in built.provenance.warnings)
    negative = raster(tmp_path, -3.0)
    with pytest.raises(CoverError, match="heights >= 0"):
        covered(grid, CoverParameters.model_validate({"cover": {"canopy": {"heights": negative}}}))


def test_a_canopy_in_a_file_of_another_crs_is_brought_to_the_ground_and_told(tmp_path: Path) -> None:
    grid = small_grid()
    west_m, south_m, east_m, north_m = grid.bounds_m
    to_degrees = pyproj.Transformer.from_crs("EPSG:32611", "EPSG:4326", always_xy=True)
    west_deg, south_deg, east_deg, north_deg = to_degrees.transform_bounds(west_m, south_m, east_m, north_m)
    # trees get higher by 10 m from the western border to the eastern one
    step_deg = (east_deg - west_deg) / 100.0
    cols, rows = 121, int((north_deg - south_deg) / step_deg) + 20
    values = np.broadcast_to(np.float32(np.arange(cols) * 0.1 + 4.0), (rows, cols))
    left_deg, top_deg = west_deg - 10.0 * step_deg, north_deg + 10.0 * step_deg
    corner = Affine(step_deg, 0.0, left_deg - step_deg / 2, 0.0, -step_deg, top_deg + step_deg / 2)
    path = write_tif(tmp_path / "degrees.tif", values, crs="EPSG:4326", transform=corner)
    heights = {"name": path.name, "base64": base64.b64encode(path.read_bytes()).decode()}
    built = covered(grid, CoverParameters.model_validate({"cover": {"canopy": {"heights": heights}}}))
    assert built.trees is not None
    rows_of, cols_of = np.indices(grid.shape)
    lon_deg, _ = to_degrees.transform(*grid.position_of(rows_of, cols_of))
    np.testing.assert_allclose(built.trees.top_m, 4.0 + 0.1 * (lon_deg - left_deg) / step_deg, atol=0.01)
    assert any(
        note.startswith("The canopy's raster: Warped from WGS 84 (") and "to WGS 84 / UTM zone 11N" in note
        for note in built.provenance.warnings
    )


def test_a_surface_model_less_the_ground_is_canopy_but_for_buildings(tmp_path: Path) -> None:
    grid = small_grid()
    surface = raster(tmp_path, grid.heights_m + 7.0)
    built = covered(grid, CoverParameters.model_validate({"cover": {**COVER, "canopy": {"surface": surface}}}))
    assert built.trees is not None
    heights_m = set(np.unique(built.trees.top_m[np.isfinite(built.trees.top_m)].round(3)).tolist())
    assert heights_m == {0.0, 7.0}
    assert any("under roofs are no canopy" in note for note in built.trees.notes)


@pytest.mark.parametrize(
    ("canopy", "sentence"),
    [
        ({}, "exactly one of heights, surface and top_m"),
        ({"top_m": 9.0, "model": "density"}, "belongs to the model density"),
        ({"top_m": -1.0}, "greater than or equal to 0"),
    ],
)
def test_a_canopy_that_is_none_is_refused(canopy: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValidationError, match=sentence):
        CoverParameters.model_validate({"cover": {"canopy": canopy}})


def test_margins_and_radios_are_there_when_a_result_is_read_again(tmp_path: Path) -> None:
    for sight in ("usable", "visible"):
        product, folder = PRODUCTS["visibility-map"], tmp_path / sight
        found = finished("visibility-map", anchors=anchors({"preset": "uwb"}), sight=sight)
        save(product, found, folder)
        _, again = load(PRODUCTS, folder)
        assert again.anchors == found.anchors
        radio = RADIOS["uwb"] if sight == "usable" else None
        assert [one.radio for one in again.anchors] == [radio] * len(found.anchors)
        names = [layer.name for layer in product.layers if layer.is_of(dict(again.parameters))]
        assert ("margin_db.tif" in names) == (sight == "usable")
        if sight == "usable":
            np.testing.assert_array_equal(again.margin_db, found.margin_db)
            (layer,) = (layer for layer in product.layers if layer.name == "margin_db.tif")
            layer.save(again, tmp_path / layer.name)
            with rasterio.open(tmp_path / layer.name) as written:
                np.testing.assert_array_equal(written.read(), found.margin_db)
        else:
            assert again.margin_db is None
