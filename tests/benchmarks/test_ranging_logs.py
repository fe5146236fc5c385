"""Published logs written as files hold what the benchmarks feed the detector."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.detection.measured_ranges import RANGING, RangeLog, plaza, starloc
from benchmarks.detection.ranging_logs import write_log
from detection import RangeEpoch
from service.cli.asking.anchor_files import ranging_anchors, ranging_asked
from service.live.epoch_logs import read_epochs

pytestmark = pytest.mark.skipif(not RANGING.is_dir(), reason="the published ranging logs lie in ../shared/data only")


def written_and_read(log: RangeLog, folder: Path, epoch_s: float) -> list[RangeEpoch]:
    write_log(log, folder)
    anchors, frame = ranging_anchors(
        ranging_asked([], [folder / "anchors.csv"], level=log.dimension == 2), level=log.dimension == 2
    )
    assert (anchors, frame) == (list(log.anchors), None)
    return read_epochs(folder / "log.csv", epoch_s).epochs


def ranges_of(epoch: RangeEpoch) -> list[tuple[str, float, float]]:
    return [(r.anchor_id, r.range_m, epoch.time_s if r.time_s is None else r.time_s) for r in epoch.ranges]


def test_rounds_of_ranges_come_back_as_rounds(tmp_path: Path) -> None:
    log = starloc(RANGING / "starloc" / "loop-2d-fast_s1")[0]
    assert list(map(ranges_of, written_and_read(log, tmp_path, 0.5))) == list(map(ranges_of, log.epochs))


def test_single_ranges_come_back_with_the_motion_before_them(tmp_path: Path) -> None:
    log = plaza()
    read = written_and_read(log, tmp_path, 0.0)
    # the log itself goes back in time now and then, and some moments come twice
    times_s = [epoch.time_s for epoch in log.epochs]
    in_order = [e for e in log.epochs if e.odometry is not None and times_s.count(e.time_s) == 1]
    by_time = {epoch.time_s: epoch for epoch in read}
    assert len(in_order) > 3000
    for epoch in in_order:
        again = by_time[epoch.time_s].odometry
        assert again is not None
        assert epoch.odometry is not None
        assert again.duration_s == epoch.odometry.duration_s
        assert again.wheel_m == epoch.odometry.wheel_m
        assert again.heading_rad == pytest.approx(epoch.odometry.heading_rad, abs=1e-12)
