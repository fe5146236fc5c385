"""The validator of paths judges what the planner returns, so it must not share a line with it."""

from __future__ import annotations

import subprocess
import sys

from tests.house.repository import ROOT, imported_modules, modules

VALIDATOR = "planning/validation"
# the words of the question; everything else of planning is the planner's
MAY_IMPORT = {"planning.errors", "planning.questions.problems"}


def test_the_validator_imports_nothing_of_planning_but_the_question() -> None:
    for module in modules(VALIDATOR):
        names = {name for name in imported_modules(module) if name.split(".")[0] == "planning"}
        others = {name for name in names if not name.startswith("planning.validation.")}
        assert others <= MAY_IMPORT, f"{module} imports {others - MAY_IMPORT}"


def test_the_validator_calls_no_kernels_and_no_maps_of_minimum_altitudes() -> None:
    for module in modules(VALIDATOR):
        for name in imported_modules(module):
            assert "kernels" not in name.split("."), f"{module} imports {name}"
        text = (ROOT / module).read_text(encoding="utf-8")
        for word in ("min_visible_altitude", "visible_sets", "dop_map(", "dop_along"):
            assert word not in text, f"{module} uses {word}, which the planner's maps are made of"


def test_the_validator_runs_without_any_planner_loaded() -> None:
    program = (
        "import sys, planning.validation\n"
        "print([name for name in sys.modules if name.startswith(('planning.paths', 'planning.kernels.path', 'ompl'))])"
    )
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
