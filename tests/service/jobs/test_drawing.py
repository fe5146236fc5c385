"""Drawing a layer in a worker."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.errors import NotFoundError
from service.jobs.folder import DataFolder
from service.jobs.tasks import TASKS, TaskContext
from service.settings import Settings


def test_a_map_that_was_deleted_before_its_layer_was_drawn_is_not_found(tmp_path: Path) -> None:
    context = TaskContext(Settings(), DataFolder(tmp_path), tmp_path / "work", lambda share: None, lambda: False)
    with pytest.raises(NotFoundError, match="There is no result 'd1'"):
        TASKS["draw-layer"](context, {"digest": "d1", "layer": "visible.tif"})
    assert not (tmp_path / "work").exists()
