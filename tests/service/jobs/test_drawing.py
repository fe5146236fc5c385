"""Drawing a layer in a worker."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.errors import NotFoundError
from service.jobs.dem_tasks import TaskContext
from service.jobs.folder import DataFolder
from service.jobs.tasks import tasks_for
from service.products.registry import PRODUCTS
from service.settings import Settings


def test_a_map_that_was_deleted_before_its_layer_was_drawn_is_not_found(tmp_path: Path) -> None:
    context = TaskContext(
        Settings(), PRODUCTS, DataFolder(tmp_path), tmp_path / "work", lambda share: None, lambda: False
    )
    with pytest.raises(NotFoundError, match="There is no result 'd1'"):
        tasks_for(PRODUCTS)["draw-layer"](context, {"digest": "d1", "layer": "visible.tif", "summary": {}})
    assert not (tmp_path / "work").exists()
