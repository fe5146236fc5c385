"""missions: what the planner keeps, listed, shown, out and in as files, deleted and restored."""

import json

import pytest

from tests.service.cli.test_store_command import told
from tests.service.folders import DEM, small_data_folder

PLACE = {"east_m": 30.0, "north_m": 25.0}
ANCHOR = {**PLACE, "id": "D1", "kind": "drone", "height_m": 40.0, "height_from": "above_ground_m"}


@pytest.fixture
def data(tmp_path):
    """A data folder with one DEM."""
    small_data_folder(tmp_path / "data", 0)
    return tmp_path / "data"


@pytest.fixture
def mission(tmp_path):
    """The file of a mission on a ground that is not here."""
    path = tmp_path / "crossing.json"
    ground = {"dem_id": DEM, "name": "hill.tif", "sha256": "0" * 64}
    path.write_text(json.dumps({"name": "Crossing", "ground": ground, "anchors": [ANCHOR]}))
    return path


def test_a_mission_goes_in_and_out_and_comes_back_the_same(sightline, data, mission, tmp_path):
    kept = told(sightline("missions", "import", mission, "--by", "Ada", "--data", data, "--json"))
    assert (kept["name"], kept["version"], kept["saved_by"], kept["anchors"]) == ("Crossing", 1, "Ada", 1)
    [listed] = told(sightline("missions", "list", "--data", data, "--json"))["missions"]
    assert listed == kept
    out = tmp_path / "out.json"
    assert sightline("missions", "export", kept["id"][:8], out, "--data", data).code == 0
    written = json.loads(out.read_text())
    assert (written["anchors"][0]["height_m"], written["ground"]["name"]) == (40.0, "hill.tif")
    again = told(sightline("missions", "import", out, "--data", data, "--json"))
    assert again["id"] != kept["id"]
    both = tmp_path / "again.json"
    assert sightline("missions", "export", again["id"], both, "--data", data).code == 0
    assert json.loads(both.read_text()) == written


def test_an_older_version_is_restored_as_the_newest(sightline, data, mission):
    from service.jobs.marker import STORE
    from service.jobs.store import Store
    from service.missions.bundle import sheet_of
    from service.missions.document import MissionIn
    from service.missions.shelf import MissionShelf

    first = told(sightline("missions", "import", mission, "--data", data, "--json"))
    store = Store(data / STORE)
    shelf = MissionShelf(store.transaction, 10, 10)
    changed = MissionIn.model_validate_json(shelf.document(first["id"])[2]).model_copy(update={"anchors": []})
    shelf.save(first["id"], sheet_of(changed), "1", "Bob")
    store.close()
    shown = told(sightline("missions", "show", first["id"], "--data", data, "--json"))
    assert [(one["version"], one["saved_by"]) for one in shown["versions"]] == [(2, "Bob"), (1, None)]
    assert shown["anchors"] == 0
    back = told(sightline("missions", "restore", first["id"], 1, "--data", data, "--json"))
    assert (back["version"], back["anchors"]) == (3, 1)


def test_a_deleted_mission_is_gone_and_a_strange_id_is_told(sightline, data, mission):
    kept = told(sightline("missions", "import", mission, "--data", data, "--json"))
    assert "Crossing" in sightline("missions", "list", "--data", data).stdout
    assert sightline("missions", "delete", kept["id"], "--data", data).code == 0
    assert told(sightline("missions", "list", "--data", data, "--json"))["missions"] == []
    gone = sightline("missions", "show", kept["id"], "--data", data)
    assert gone.code != 0
    assert kept["id"] in gone.stderr


def test_what_needs_the_ground_says_that_it_is_not_here(sightline, data, mission, tmp_path):
    kept = told(sightline("missions", "import", mission, "--data", data, "--json"))
    refused = sightline("missions", "export", kept["id"], tmp_path / "out.kml", "--data", data)
    assert refused.code != 0
    assert "hill.tif" in refused.stderr
    assert not (tmp_path / "out.kml").exists()
    odd = sightline("missions", "export", kept["id"], tmp_path / "out.doc", "--data", data)
    assert odd.code == 2
    assert ".geojson" in odd.stderr


def test_what_is_not_there_or_no_mission_is_bad_input(sightline, data, tmp_path):
    sightline("missions", "show", "nope", "--data", data).refused("There is no mission 'nope'")
    sightline("missions", "import", tmp_path / "none.zip", "--data", data).refused("There is no file", "none.zip")
    (tmp_path / "town.json").write_text('{"type": "FeatureCollection", "features": []}')
    sightline("missions", "import", tmp_path / "town.json", "--data", data).refused("town.json is no mission: ")
    sightline("missions", "list", "--data", tmp_path / "typo").refused("There is no data folder", "typo")
    assert not (tmp_path / "typo").exists()
