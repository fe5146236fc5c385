"""`make fuzz` in short, the same requests every time: what follows OpenAPI's links is answered as it says."""

from __future__ import annotations

import itertools
import random
from pathlib import Path

from service.http.app import create_app
from service.settings import Settings
from tests.fuzzing.grounds import made_ids
from tests.fuzzing.linked import Asking, asked
from tests.service.running import running

CASES, SEED = 240, 1
MAPS = ("/visibility-maps", "/dop-maps", "/morphing-maps")  # as made_ids makes them


def test_requests_that_follow_links_are_answered_as_the_document_says(tmp_path: Path) -> None:
    document = create_app(Settings()).openapi()
    with running(tmp_path / "data", max_job_s=60, rehearse="maps") as server:
        known = made_ids(server, tmp_path, document)
        made = {path: [map_id] for path, map_id in zip(MAPS, known["map_id"], strict=True)}
        told = set(itertools.chain(*known.values()))
        asking = Asking(server.url, document, known, made, random.Random(SEED), told)
        asked(asking, CASES, SEED)
    assert not asking.failures, asking.examples
    assert asking.cases >= CASES
    # with ids of what is there, much comes of it
    assert len(asking.answered) > 30
    assert asking.statuses[200] + asking.statuses[201] > CASES // 5
