"""Gates that geometry says are wide enough are found, wherever their fence stands among the posts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.planning.gates import gate_problems
from planning.paths import PathStatus, plan_path
from planning.validation import validate_path


@pytest.mark.parametrize(("low", "high"), [(1.0, 1.5), (1.5, 3.0)])
def test_a_gate_hardly_wider_than_the_rover_is_found(low: float, high: float) -> None:
    for problem, gate_m in gate_problems(8, low, high, seed=77):
        outcome = plan_path(problem)
        assert outcome.status is PathStatus.FOUND, (gate_m, outcome.sentence)
        assert outcome.path is not None
        assert validate_path(problem, np.column_stack([outcome.path.east_m, outcome.path.north_m])).passed


def test_a_gate_narrower_than_the_rover_is_proved_closed() -> None:
    for problem, gate_m in gate_problems(6, 1.0, 2.0, seed=78):
        wider = replace(problem, rover=replace(problem.rover, footprint_radius_m=0.5 * gate_m + 0.3))
        outcome = plan_path(wider)
        assert outcome.status is PathStatus.UNREACHABLE, outcome.sentence
