"""The shelf of missions keeps what it should in either database."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from service.database import Database
from service.errors import EditConflictError, LimitError, NotFoundError
from service.jobs.records import DemRecord
from service.jobs.store import Store
from service.missions.shelf import MissionShelf, Sheet


def test_a_mission_lives_with_its_versions_and_finds_its_ground(opened: Callable[[], Database]) -> None:
    store = Store(opened())
    shelf = MissionShelf(store.transaction, 2, 2)
    store.add_dem(DemRecord("d1", "Grüne Höhe.asc", 1.0, {"sha256": "abc", "name": "a\0\\\0\\u0000", "cells": 12}))
    made = shelf.add(Sheet('{"a": "ä%?"}', "100 %, was?", 1, "abc"), "Ada")
    assert (made.name, made.dem_id, made.version, shelf.dem_with_digest("none")) == ("100 %, was?", "d1", 1, None)
    assert store.dem("d1").summary["name"] == "a\0\\\0\\u0000"
    for version in range(2, 5):
        shelf.save(made.id, Sheet(f"{version}", "n\0", version, "other"), str(version - 1), None)
    with pytest.raises(EditConflictError, match="version 4 by somebody"):
        shelf.save(made.id, Sheet("5", "next", 5), "3", None)
    mission, version, document = shelf.document(made.id, 1)
    assert (mission.anchors, mission.dem_id, version.saved_by, document) == (4, None, "Ada", '{"a": "ä%?"}')
    # the first and the newest stay of those without a name
    assert [one.version for one in shelf.versions(made.id, 10, 0)[0]] == [4, 1]
    assert shelf.name_version(made.id, 1, "begun").name == "begun"
    other = shelf.add(Sheet("{}", "other", 0), None)
    with pytest.raises(LimitError, match="2 missions already"):
        shelf.add(Sheet("{}", "third", 0), None)
    assert ([one.id for one in shelf.missions(1, 1)[0]], shelf.missions(1, 1)[1]) == ([made.id], 2)
    shelf.remove(made.id)
    with pytest.raises(NotFoundError):
        shelf.versions(made.id, 1, 0)
    assert [one.id for one in shelf.missions(9, 0)[0]] == [other.id]
    store.close()
