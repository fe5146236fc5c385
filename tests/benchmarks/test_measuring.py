"""The benchmarks measure what they say: a planted error is found, a missed target is told, the peer answers rightly."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as program
from benchmarks.pages import parts_of
from benchmarks.report import Row, Table, as_markdown, duration, missed
from benchmarks.terrains import fractal_grid, fractal_m, spread_anchors
from benchmarks.timing import best_of_each_s
from benchmarks.visibility.deviation import deviation, pooled
from benchmarks.visibility.gdal_peer import GdalDem
from visibility import FLAT, Anchor, min_visible_altitude

MISSED = Table("Speed", ("what", "ratio"), [Row(("fast", "2 ×"), "≥ 8 ×", False), Row(("exact", "9 ×"), "≥ 8 ×", True)])


def test_gdal_sees_over_a_wall_as_geometry_says() -> None:
    heights_m = np.zeros((21, 41), np.float32)
    heights_m[:, 10] = 30.0
    dem = GdalDem(heights_m, 5.0, 5.0)
    altitude_m = dem.min_visible_altitude(10, 0, 50.0)
    dem.close()
    behind = np.arange(11, 31)
    # down from the eye at 50 m over the wall of 30 m, ten posts away: 2 m per post
    assert altitude_m[10, behind] == pytest.approx(np.maximum(50.0 - 2.0 * behind, 0.0), abs=1e-4)


def test_the_same_answer_deviates_by_nothing() -> None:
    grid = fractal_grid(48)
    anchor = spread_anchors(grid, 1)[0][0]
    exact_m = min_visible_altitude(grid, [anchor], "exact", FLAT).altitude_m[0]
    found = deviation(grid, anchor, exact_m, exact_m, (0.0, 1.5))
    assert (found.worst(0.0), found.worst(1.5), found.largest_m, found.wild) == (0.0, 0.0, 0.0, 0)


def test_a_planted_error_is_counted_and_called_wild() -> None:
    grid = fractal_grid(48)
    anchor = Anchor("A", *grid.position_of(5, 5), altitude_m=float(grid.heights_m.max()) + 1.0)
    exact_m = min_visible_altitude(grid, [anchor], "exact", FLAT).altitude_m[0]
    hidden = np.argwhere(exact_m > grid.heights_m + 5.0)
    row, col = hidden[len(hidden) // 2]
    wrong_m = exact_m.copy()
    wrong_m[row, col] -= 100_000.0
    found = deviation(grid, anchor, wrong_m, exact_m, (0.0,))
    assert found.worst(0.0) == pytest.approx(1.0 / (grid.heights_m.size - 1))
    assert (found.wild, found.largest_m) == (1, pytest.approx(100_000.0, rel=1e-6))
    both = pooled([found, deviation(grid, anchor, exact_m, exact_m, (0.0,))])
    assert (both.wild, both.worst(0.0), both.mean(0.0)) == (1, found.worst(0.0), found.worst(0.0) / 2.0)


def test_the_fractal_is_the_same_every_time_and_fills_its_relief() -> None:
    heights_m = fractal_m(32, seed=1)
    assert np.array_equal(heights_m, fractal_m(32, seed=1))
    assert (heights_m.min(), heights_m.max()) == (0.0, 1500.0)


def test_calls_take_turns_and_the_shortest_time_counts() -> None:
    turns: list[str] = []
    calls = {"a": lambda: turns.append("a"), "b": lambda: turns.append("b")}
    best_s = best_of_each_s(calls, rounds=3, budget_s=math.inf)
    assert turns == ["a", "b"] * 4
    assert all(time_s > 0.0 for time_s in best_s.values())


def test_a_missed_target_is_told_and_only_its_part_of_the_page_is_new(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    met = Table("Size", ("what", "bytes"), [Row(("map", "9"), "≤ 10", True)])
    monkeypatch.setattr(program, "GROUPS", {"size": (lambda: met,), "loop-speed": (lambda: MISSED,)})
    page = tmp_path / "page.md"

    def run(*words: str) -> str:
        monkeypatch.setattr("sys.argv", ["benchmarks", *words, "--write", str(page)])
        program.main()
        return capsys.readouterr().out

    assert "missed: Speed: fast | 2 × (target ≥ 8 ×)\n1 of 2 targets met" in run("--only", "loop-speed")
    assert list(parts_of(page.read_text(encoding="utf-8"))) == ["loop-speed"]
    run("--only", "size")
    parts = parts_of(page.read_text(encoding="utf-8"))
    assert list(parts) == ["size", "loop-speed"]
    assert "| fast | 2 × | ≥ 8 × | **missed** |" in parts["loop-speed"]
    assert "*Group `loop-speed`: CPU " in parts["loop-speed"]
    before = page.read_text(encoding="utf-8")
    monkeypatch.setattr(program.machine, "description", lambda: {"CPU": "another"})
    run("--only", "size")
    after = parts_of(page.read_text(encoding="utf-8"))
    assert "*Group `size`: CPU another.*" in after["size"]
    assert after["loop-speed"].rstrip() == parts_of(before)["loop-speed"].rstrip()


def test_tables_without_a_missed_target_are_well() -> None:
    table = Table("Speed", ("what", "ratio"), [MISSED.rows[1], Row(("copy", "1 ×"))])
    assert missed([table]) == []
    assert as_markdown(table).endswith("| exact | 9 × | ≥ 8 × | met |\n| copy | 1 × |  |  |\n")


@pytest.mark.parametrize(("seconds", "words"), [(12.3456, "12.3 s"), (0.0123456, "12.3 ms"), (4.2e-5, "42 µs")])
def test_times_are_written_with_the_unit_that_suits_them(seconds: float, words: str) -> None:
    assert duration(seconds) == words
