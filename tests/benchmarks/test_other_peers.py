"""Peers that are not installed are told with a reason; the one that is a program of its own is asked as it wants."""

from pathlib import Path

import pytest

from benchmarks.visibility import other_peers, speed
from terrain.synthetic import fractal

FAKE = """#!/bin/sh
echo "$@" >> "$(dirname "$0")/asked.txt"
"""


def test_a_peer_that_is_not_installed_is_told_with_what_would_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr("shutil.which", lambda name: None)
    grid = fractal(33, seed=1)
    for peer, package in ((other_peers.xarray_spatial, "xarray-spatial"), (other_peers.grass, "grass-core")):
        timed = peer(grid, 16, 16, 100.0)
        assert timed.seconds is None
        assert package in timed.reason
    rows = speed._exact_rows(grid, {"exact": 1e-3}, 33)
    assert all(row.met is None and row.cells[-1].startswith("skipped: not installed") for row in rows)
    assert len(rows) == 2


def test_grass_is_asked_for_the_observers_place_in_metres(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "grass"
    program.write_text(FAKE, encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setattr("shutil.which", lambda name: str(program))
    timed = other_peers.grass(fractal(33, seed=1, cell_m=30.0), 10, 20, 100.0)
    asked = (tmp_path / "asked.txt").read_text(encoding="utf-8").splitlines()
    assert "r.in.gdal" in asked[1]
    # row 10 of 33 from the north, column 20 from the west, in the middle of its cell
    assert f"coordinates={20.5 * 30.0},{22.5 * 30.0}" in asked[-1]
    assert "observer_elevation=100.0" in asked[-1]
    assert timed.seconds is not None
    assert timed.seconds > 0.0


def test_what_grass_says_of_a_failure_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "grass"
    program.write_text("#!/bin/sh\necho 'no such projection' >&2\nexit 1\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setattr("shutil.which", lambda name: str(program))
    with pytest.raises(RuntimeError, match="no such projection"):
        other_peers.grass(fractal(33, seed=1), 16, 16, 100.0)
