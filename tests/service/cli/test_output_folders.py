"""--out replaces what a run before has written, and never what is somebody's own."""

import json

import pytest
import rasterio

import service.cli.asking.products
from service.files.layer import Layer
from tests.service.small_maps import NORTH_M, WEST_M

GOOD = f"D1,{WEST_M + 300.0},{NORTH_M - 300.0},40agl"


@pytest.mark.parametrize("name", ["map.png", "visibility.json", "count.tif"])
def test_somebodys_file_is_not_replaced(sightline, dem_file, tmp_path, name):
    (tmp_path / name).write_text('{"mine": true}')
    ended = sightline("visibility", dem_file, "--anchor", GOOD, "--out", tmp_path)
    assert (ended.code, ended.stdout) == (2, "")
    assert f"{tmp_path / name} is there already and was not written by Sightline" in ended.stderr
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {name: '{"mine": true}'}


def test_a_file_of_somebodys_that_this_run_would_only_remove_is_not_removed(sightline, dem_file, tmp_path):
    (tmp_path / "before.png").write_text("mine")
    words = ("place", dem_file, "--count", 1, "--spacing", 150, "--height", "40agl", "--out", tmp_path)
    ended = sightline(*words)
    assert ended.code == 2
    assert "before.png is there already" in ended.stderr
    assert (tmp_path / "before.png").read_text() == "mine"


def test_a_second_run_replaces_the_first(sightline, dem_file, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    for height_m in (1.5, 2.5):
        ended = sightline(*("visibility", dem_file, "--anchor", GOOD, "--receiver-height", height_m, "--out", tmp_path))
        assert ended.code == 0, ended.stderr
    assert json.loads((tmp_path / "visibility.json").read_text())["receiver"]["above_ground_m"] == 2.5
    with rasterio.open(tmp_path / "visible.tif") as dataset:
        assert dataset.tags()["receiver"] == "2.5 m above ground"
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("form", [["--anchors", "{}"], ["--anchors={}"]])
def test_an_input_is_not_replaced_by_an_output(sightline, dem_file, tmp_path, form):
    assert sightline("visibility", dem_file, "--anchor", GOOD, "--out", tmp_path).code == 0
    drones = tmp_path / "visibility.json"
    anchor = {"id": "D1", "east_m": WEST_M + 300.0, "north_m": NORTH_M - 300.0, "above_ground_m": 40.0}
    drones.write_text(json.dumps({"anchors": [anchor], "version": "mine"}))
    before = drones.read_text()
    ended = sightline("visibility", dem_file, *(word.format(drones) for word in form), "--out", tmp_path)
    assert ended.code == 2
    assert "is read by this command and would be overwritten" in ended.stderr
    assert drones.read_text() == before


def test_a_first_run_that_fails_leaves_nothing_and_the_next_is_not_refused(sightline, dem_file, tmp_path, monkeypatch):
    whole = service.cli.asking.products.json.dumps

    def fail(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(service.cli.asking.products.json, "dumps", fail)
    with pytest.raises(KeyboardInterrupt):
        service.cli.asking.products._write_files(FINISHED, {}, "a.json", LAYERS, tmp_path)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(service.cli.asking.products.json, "dumps", whole)
    service.cli.asking.products._write_files(FINISHED, {}, "a.json", LAYERS, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"a.json", "b"}


FINISHED = object()
LAYERS = (Layer("b", "text/plain", "A layer.", lambda finished, path: path.write_text("layer")),)
