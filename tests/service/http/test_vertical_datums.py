"""Over HTTP DEMs and altitudes say what they count from; what cannot be brought there is refused with one sentence."""

from __future__ import annotations

from typing import Any

import pytest

from dem_samples import load_sample, sample_path
from terrain import egm96_height_m, to_lon_lat
from tests.service.running import Server

EAST_M, NORTH_M = 745_000.0, 4_020_000.0


def uploaded(server: Server, datum: str | None) -> Any:
    content = sample_path("jacksboro").read_bytes()
    params = {"filename": "jacksboro.tif"} | ({} if datum is None else {"vertical_datum": datum})
    return server.client.post("/dems", params=params, content=content)


def test_a_dem_is_read_as_counting_from_what_the_caller_says(server: Server) -> None:
    dem = uploaded(server, "EGM96").json()
    assert (dem["vertical_datum"], dem["heights_count_from"]) == ("EGM96 geoid", "sea level")
    assert any("vertical_datum= says: EGM96 geoid" in sentence for sentence in dem["conversions"])
    unknown = uploaded(server, None).json()
    assert (unknown["vertical_datum"], unknown["heights_count_from"]) == (None, "unknown")
    assert unknown["id"] != dem["id"]


def test_an_unknown_datum_is_refused(server: Server) -> None:
    answer = uploaded(server, "sea")
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/vertical-datum"
    assert "'sea' is not known; name msl" in answer.json()["detail"]


def test_anchors_are_brought_to_the_dems_datum_and_that_is_told(server: Server) -> None:
    dem_id = uploaded(server, "EGM96").json()["id"]
    anchor = {"id": "A", "east_m": EAST_M, "north_m": NORTH_M, "altitude_m": 1100.0, "altitude_datum": "hae"}
    asked = {"dem_id": dem_id, "anchors": [anchor]}
    answer = server.client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    result = answer.json()["result"]
    geoid_m = float(egm96_height_m(*to_lon_lat(load_sample("jacksboro"), EAST_M, NORTH_M)))
    assert result["anchors"][0]["altitude_m"] == pytest.approx(1100.0 - geoid_m, abs=1e-6)
    (told,) = (warning for warning in result["warnings"] if "given as hae" in warning)
    assert told == f"Altitudes given as hae were brought to the DEM's datum, EGM96 geoid: {-geoid_m:+.2f} m."


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"altitude_datum": "sea"}, "The vertical datum 'sea' is not known"),
        ({"altitude_m": None, "above_ground_m": 9.0, "altitude_datum": "hae"}, "altitude_datum goes with altitude_m"),
    ],
)
def test_a_datum_that_means_nothing_is_refused(server: Server, changes: dict[str, Any], sentence: str) -> None:
    anchor = {"id": "A", "east_m": EAST_M, "north_m": NORTH_M, "altitude_m": 1100.0} | changes
    anchor = {name: value for name, value in anchor.items() if value is not None}
    dem_id = uploaded(server, "EGM96").json()["id"]
    answer = server.client.post("/visibility-maps", json={"dem_id": dem_id, "anchors": [anchor]})
    assert answer.status_code == 422
    assert sentence in answer.text


def test_a_model_that_is_missing_between_two_sea_levels_is_named(server: Server) -> None:
    dem_id = uploaded(server, "EGM96").json()["id"]
    anchor = {"id": "A", "east_m": EAST_M, "north_m": NORTH_M, "altitude_m": 1100.0, "altitude_datum": "LN02 height"}
    answer = server.client.post("/visibility-maps", json={"dem_id": dem_id, "anchors": [anchor]})
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/vertical-datum"
    assert "LN02 height cannot be brought to EGM96 geoid" in answer.json()["detail"]


def test_no_altitude_on_the_moon_counts_from_a_datum_of_the_earth(server: Server) -> None:
    dem = server.sample("crater")
    anchor = {"id": "A", "east_m": 0.0, "north_m": 0.0, "altitude_m": 5000.0, "altitude_datum": "EGM96"}
    answer = server.client.post("/visibility-maps", json={"dem_id": dem["id"], "anchors": [anchor]})
    assert answer.status_code == 422
    assert "lies on Moon, where no altitude counts from EGM96" in answer.text
