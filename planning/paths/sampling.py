"""OMPL's objects around exact segments, for a process that plans and does nothing else.

OMPL's own checking at a resolution is not used: it jumps thin walls. Each motion is judged and costed exactly, once.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from planning.errors import PlanningProcessError

__all__ = ["Motions", "OwnProcess", "SamplingTask", "Tell", "box_space", "solved"]

Places = npt.NDArray[np.float64]
State = Any
# takes the corners of a whole path that is better than what was told before
Tell = Callable[[Places], None]

# how often, in questions of the planner whether to stop, it is asked whether anybody still waits for the answer
QUESTIONS_BETWEEN = 256
PACKAGE_ROOT = Path(__file__).parents[2]
# how often it is asked whether the plan was stopped
POLL_S = 0.02


class SamplingTask(Protocol):
    """Something for the process to solve; pickled on its way there and back."""

    @property
    def seed(self) -> int:
        """What the planner's random numbers come of."""

    def solve(self, tell: Tell) -> Places | None:
        """Corners of a path as the task defines them, None where none was found; better ones are told on the way."""


class Motions(Protocol):
    """What a planner has to know of states, which are OMPL's."""

    def allowed(self, state: State) -> bool:
        """Whether a state can be held."""

    def cost(self, begin: State, end: State) -> float:
        """Of the motion from state to state; +inf where it breaks a limit."""


def box_space(bounds: Sequence[tuple[float, float]]) -> Any:
    """OMPL's space of real numbers within bounds."""
    from ompl import base

    space = base.RealVectorStateSpace(len(bounds))
    limits = base.RealVectorBounds(len(bounds))
    for axis, (low, high) in enumerate(bounds):
        limits.setLow(axis, float(low))
        limits.setHigh(axis, float(high))
    space.setBounds(limits)
    return space


def solved(
    space: Any,
    motions: Motions,
    planner_name: str,
    begin: Sequence[float],
    end: Sequence[float],
    iterations: int,
    better: Callable[[list[State]], None] | None = None,
) -> list[State] | None:
    """States of a path from begin to end that is exact, after so many iterations; None where none was found.

    better: called with the states of each path that is cheaper than the one before, where the planner knows of it.
    """
    from ompl import base, geometric

    information = base.SpaceInformation(space)
    judges = _judges(base, information, motions)
    information.setStateValidityChecker(judges[0])
    information.setMotionValidator(judges[1])
    information.setup()
    definition = base.ProblemDefinition(information)
    states = [space.allocState(), space.allocState()]
    for state, values in zip(states, (begin, end), strict=True):
        for axis, value in enumerate(values):
            state[axis] = float(value)
    definition.setStartAndGoalStates(*states)
    definition.setOptimizationObjective(judges[2])
    planner = getattr(geometric, planner_name)(information)
    planner.setProblemDefinition(definition)
    planner.setup()
    # the wheel's callback for better paths takes no Python function: BIT* halts at each one instead, and goes on
    halts = better is not None and planner_name == "BITstar"
    if halts:
        planner.setStopOnSolnImprovement(True)
    count = _Count(iterations)
    found, begun_at = None, -1
    # a planner that asks nothing any more is through
    while not count.spent and count.asked > begun_at:
        begun_at = count.asked
        status = planner.solve(base.PlannerTerminationCondition(count.over))
        # a status is true of a path that stops short of the goal, too
        if status.asString() == "Exact solution":
            path = definition.getSolutionPath()
            found = [path.getState(n) for n in range(path.getStateCount())]
        if not halts:
            break
        if found is not None and better is not None:
            better(found)
    return found


class _Count:
    """A condition that stops by count, so that one seed gives one path; and where nobody waits any more."""

    def __init__(self, iterations: int) -> None:
        self.asked, self._iterations, self._parent = 0, iterations, os.getppid()

    @property
    def spent(self) -> bool:
        """Whether there are no iterations left."""
        return self.asked > self._iterations

    def over(self) -> bool:
        """Count one more."""
        self.asked += 1
        if self.asked % QUESTIONS_BETWEEN == 0 and os.getppid() != self._parent:
            os._exit(1)
        return self.spent


def _judges(base: Any, information: Any, motions: Motions) -> tuple[Any, Any, Any]:
    """Validity, segments and cost, as OMPL asks for them; it keeps no references of its own to what Python made."""
    last: list[Any] = [None, math.inf]

    def cost(a: State, b: State) -> float:
        # validity and cost of one motion are asked one after the other
        key = (*(a[axis] for axis in range(axes)), *(b[axis] for axis in range(axes)))
        if key != last[0]:
            last[0], last[1] = key, motions.cost(a, b)
        return float(last[1])

    class Checker(base.StateValidityChecker):  # type: ignore[misc] # OMPL ships no types
        def isValid(self, state: State) -> bool:  # noqa: N802 - OMPL's name
            return motions.allowed(state)

    class Segments(base.MotionValidator):  # type: ignore[misc] # OMPL ships no types
        def checkMotion(self, a: State, b: State) -> bool:  # noqa: N802 - OMPL's name
            return cost(a, b) < math.inf

    class Objective(base.OptimizationObjective):  # type: ignore[misc] # OMPL ships no types
        def stateCost(self, _state: State) -> Any:  # noqa: N802 - OMPL's name
            return base.Cost(0.0)

        def motionCost(self, a: State, b: State) -> Any:  # noqa: N802 - OMPL's name
            return base.Cost(cost(a, b))

        def isSymmetric(self) -> bool:  # noqa: N802 - OMPL's name; uphill costs more than downhill
            return False

    axes = information.getStateDimension()
    return Checker(information), Segments(information), Objective(information)


class OwnProcess:
    """A fresh process that solves one task; leave it as a context, and it is gone."""

    def __init__(self) -> None:
        path = [str(PACKAGE_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        # -P: a folder named like one of our packages, where the caller works, must not be imported
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "planning.paths.solving", str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        )
        self._answer: dict[str, npt.NDArray[np.float64] | None] | None = None
        self._best: npt.NDArray[np.float64] | None = None
        self._heard = threading.Event()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with contextlib.suppress(BrokenPipeError):
                pipe.close()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def best(self) -> npt.NDArray[np.float64] | None:
        """The corners that it told last, of the best path until now."""
        return self._best

    def begin(self, task: SamplingTask) -> None:
        """Hand over the task; it is solved as soon as the process has loaded."""
        threading.Thread(target=self._talk, args=(pickle.dumps(task, protocol=5),), daemon=True).start()

    def answer(self, ended: Callable[[], bool]) -> tuple[bool, npt.NDArray[np.float64] | None]:
        """(whether it came to its end, its corners or None); raises PlanningProcessError where the process died.

        Where it was ended, the corners are the best that it had told until then.
        """
        while not self._heard.wait(POLL_S):
            if ended():
                return False, self._best
        if self._answer is None:
            code = self._process.wait()
            raise PlanningProcessError(f"The process that planned ended before its answer, with exit code {code}.")
        return True, self._answer["corners"]

    def _talk(self, task: bytes) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        # a process that is killed meanwhile leaves the answer empty
        with contextlib.suppress(OSError, EOFError, ValueError, pickle.UnpicklingError):
            self._process.stdin.write(task)
            self._process.stdin.flush()
            while "better" in (message := pickle.load(self._process.stdout)):
                self._best = message["better"]
            self._answer = message
        self._heard.set()
