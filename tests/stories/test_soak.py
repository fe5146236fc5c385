"""`make soak` in short: under retention nothing grows without end, and kills lose nothing."""

from __future__ import annotations

from pathlib import Path

from benchmarks.service.soak import KEEP_BYTES, kill, use

MB = 1_000_000


def test_many_maps_and_epochs_leave_descriptors_and_disk_as_they_were(tmp_path: Path) -> None:
    looks = list(use(tmp_path, 60, 2000))
    assert [(what, count) for what, count, _ in looks][19::20] == [("maps", 60), ("epochs", 2000)]
    # each for itself: the first session loads what maps have not needed, some 70 MB
    for first, last in ((looks[0][2], looks[19][2]), (looks[20][2], looks[-1][2])):
        assert last.descriptors <= first.descriptors + 2
        assert last.disk_bytes <= first.disk_bytes + KEEP_BYTES
        assert last.server_bytes <= first.server_bytes + 30 * MB


def test_kills_at_random_moments_lose_no_result_and_leave_no_half_file_and_no_process(tmp_path: Path) -> None:
    lost = kill(tmp_path, 8, seed=3)
    assert (lost.kills, lost.results, lost.half, lost.orphans) == (8, 0, (), 0), lost
