"""The tables on volumes and morphing maps run, and recompute one surface where one anchor moved."""

from __future__ import annotations

from benchmarks.visibility import volumes


def test_one_anchor_that_moves_is_the_only_one_recomputed() -> None:
    (row,) = volumes.one_moves(posts=48, count=16).rows
    assert row.cells[3] == "1"
    assert row.met


def test_growth_and_memory_measure_volumes_of_the_sizes_asked_for() -> None:
    growth = volumes.volume_growth(sizes=(16, 24, 32, 48), layer_counts=(5, 10, 20, 40))
    assert [row.cells[:2] for row in growth.rows[:4]] == [("16²", "10"), ("24²", "10"), ("32²", "10"), ("48²", "10")]
    assert [row.cells[1] for row in growth.rows[4:]] == ["5", "10", "20", "40"]
    (memory,) = volumes.volume_memory(cases=((32, 5),)).rows
    assert memory.met


def test_the_morphing_map_is_timed_for_both_kinds_of_ranges() -> None:
    table = volumes.morphing_speed(posts=64, count=8)
    assert len(table.rows) == 2
    assert [row.met for row in table.rows] == [True, None]
