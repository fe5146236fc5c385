"""What a worker does when ground is asked for from a source: it names the DEM, reads it, and leaves nothing behind."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from service.errors import RequestError
from service.ground.coverage import LIBRARY, STORE
from service.jobs.dem_tasks import TaskContext, plan_ground, read_ground, tell_coverage
from service.jobs.folder import DataFolder
from service.jobs.kept_files import load_grid
from service.settings import GroundSource, Settings
from terrain import Circle, GroundLibrary, GroundSourceError, index_ground, read_mosaic
from terrain.tiles.library import edited
from tests.service.ground.range_server import RangeServer, serving
from tests.service.ground.test_remote import whole_of, write_cell
from tests.terrain.tiles.cutting import cut_tif, rough

ASKED = {"area": {"lon_deg": -84.3, "lat_deg": 36.4, "radius_m": 2000.0}, "source": "glo-90"}


@pytest.fixture
def server(tmp_path: Path) -> Iterator[RangeServer]:
    write_cell(tmp_path / "www", -85, 36)
    with serving(tmp_path / "www") as server:
        yield server


@pytest.fixture
def context(server: RangeServer, tmp_path: Path) -> Iterator[TaskContext]:
    folder = DataFolder.open(tmp_path / "data")
    source = GroundSource(base=server.url, scheme="copernicus-glo-90")
    settings = Settings(ground_sources={"glo-90": source}, data_folder=folder.root)
    yield TaskContext(settings, {}, folder, folder.work("0" * 32), lambda share: None, lambda: False)
    folder.close()


def ask(context: TaskContext, asked: dict[str, Any]) -> dict[str, Any]:
    return dict(plan_ground(context, {"body": json.dumps(asked)}))


def test_ground_of_a_source_is_kept_as_a_dem(context: TaskContext, server: RangeServer) -> None:
    planned = ask(context, ASKED)
    assert server.asked == [], "naming the DEM asks nobody"
    told = read_ground(context, planned)
    grid = load_grid(context.work)
    np.testing.assert_array_equal(
        grid.heights_m, read_mosaic([whole_of(server)], Circle(-84.3, 36.4, 2000.0)).heights_m
    )
    assert (told["crs"], told["unknown_posts"], told["heights_count_from"]) == ("EPSG:32616", 0, "sea level")
    assert list(context.folder.incoming.iterdir()) == []
    assert (context.folder.root / STORE).is_dir()
    assert ask(context, ASKED)["dem_id"] == planned["dem_id"]
    assert tell_coverage(context, {})["sources"] == ["glo-90"]


def test_a_source_that_fails_leaves_nothing_but_what_came(context: TaskContext, server: RangeServer) -> None:
    server.how = "html"
    with pytest.raises(GroundSourceError, match="web page"):
        read_ground(context, ask(context, ASKED))
    assert list(context.folder.incoming.iterdir()) == []
    assert not context.work.exists()


def test_a_source_that_is_not_listed_is_refused_before_anything_is_asked(
    context: TaskContext, server: RangeServer
) -> None:
    with pytest.raises(RequestError, match="the operator lists: glo-90"):
        ask(context, {**ASKED, "source": server.url})
    assert server.asked == []


def test_what_takes_long_is_known_before_any_height_is_read(context: TaskContext, tmp_path: Path) -> None:
    """1.6 km at 1.6 m are a million posts, at 0.4 m 16 million; of a source nobody knows."""
    at = rasterio.Affine(30, 0, 700_000, 0, -30, 5_100_000)
    cut_tif(tmp_path / "tiles", rough(120, 150), at, shared=True)
    with edited(context.folder.root / LIBRARY) as editing:
        editing.library, _ = index_ground(GroundLibrary(), [tmp_path / "tiles"])
    area = {"lon_deg": 11.62, "lat_deg": 46.0, "radius_m": 800.0}
    for cell_m, takes_long in ((None, False), (1.6, False), (0.4, True), (0.01, False)):  # the last is refused at once
        assert ask(context, {"area": area, "cell_m": cell_m})["takes_long"] is takes_long, cell_m
    assert ask(context, ASKED)["takes_long"]
