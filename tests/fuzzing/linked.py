"""Requests that go on from each other's answers, as OpenAPI's links say, on what is really there.

    python -m tests.fuzzing.linked --cases 10000 --seed 1

Bodies are generated from the document, or are its examples on a ground of the service, so that much of it succeeds.
Each answer is held against the document: status, type, headers, shape; what was made is there, what was deleted is not.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import math
import random
import re
import signal
import sys
import tempfile
import time
import uuid
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import hypothesis
import schemathesis
from schemathesis.core import NOT_SET
from schemathesis.core.failures import Failure, FailureGroup
from schemathesis.core.transport import Response
from schemathesis.hooks import GLOBAL_HOOK_DISPATCHER
from schemathesis.specs.openapi.checks import negative_data_rejection

from service.files.layer import COG
from service.http.app import create_app
from service.products.registry import PRODUCTS
from service.settings import Settings
from tests.fuzzing.grounds import CHANGES, made_ids
from tests.service.running import Server, running

__all__ = ["Asking", "asked", "main", "one_of_each"]

ID = re.compile(r"[0-9a-f]{32}")
STEPS, SCENARIOS = 12, 40
# longer than anything here takes
PATIENCE_S = 60.0
LATEST = 3  # of what was made
MOST_BYTES = 100_000  # of an answer that are looked through for ids
# layers that every result has: that one lacks what was not asked for is no fault
LAYERS = {
    product.path: [layer for layer in product.layers if layer.needs is layer.mission is layer.status is None]
    for product in PRODUCTS.values()
}


@dataclass(slots=True)
class Asking:
    """A service that is asked, what is there, and what came of it; failures: how often, by operation and words.

    known: what is there from the beginning and stays, by the names that parameters have for it. told: ids of answers.
    made: ids of what was asked for, by the path of all of its kind; what is there from the beginning stays, here too.
    """

    url: str
    document: dict[str, Any]
    known: dict[str, list[str]]
    made: dict[str, list[str]]
    chance: random.Random
    told: set[str]
    cases: int = 0
    statuses: Counter[int] = field(default_factory=Counter)
    operations: Counter[str] = field(default_factory=Counter)
    answered: set[str] = field(default_factory=set)  # operations that something came of
    failures: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    kept: frozenset[str] = field(init=False)  # what is asked about to the end has to be there to the end

    def __post_init__(self) -> None:
        self.kept = frozenset(itertools.chain(*self.known.values(), *self.made.values()))

    def make_real(self, case: schemathesis.Case) -> None:
        """Put what is there into a case, most of the time; ids that a link has put there stay."""
        label, rarely = case.operation.label, self.chance.random() < 0.2
        deletes = case.method.upper() == "DELETE" and case.operation.path.endswith("}")
        if deletes:
            case.path_parameters |= {
                name: uuid.UUID(int=self.chance.getrandbits(128)).hex
                for name, given in case.path_parameters.items()
                if given in self.kept
            }
        if rarely:
            return
        if label == "POST /dems":
            if case.meta is None or case.meta.generation.mode.is_positive:
                case.query, case.body = {"sample": "valley"}, NOT_SET
            return
        path = case.operation.path.partition("/{")[0]
        jobs = self.made.get(path, [])
        jobs = [*jobs[:1], *jobs[-LATEST:]]
        for name, given in dict(case.path_parameters or {}).items():
            if name in ("layer", "name"):
                tiles = "/tiles/" in case.operation.path
                names = [layer.name for layer in LAYERS.get(path, []) if layer.media_type == COG or not tiles]
                case.path_parameters[name] = self.chance.choice(names or ["mission.json"])
            elif name in ("level", "row", "col"):
                case.path_parameters[name] = 0
            elif given not in self.told and not deletes:
                known = jobs if name == "job_id" else self.known.get(name)
                case.path_parameters[name] = self.chance.choice(known or [given])
        if "dem_id" in (case.query or {}) and case.query["dem_id"] not in self.told:
            case.query["dem_id"] = self.known["dem_id"][0]
        self._make_body_real(case)

    def _make_body_real(self, case: schemathesis.Case) -> None:
        name, model = self._model_of(case)
        if not model or case.media_type != "application/json":
            return
        dem_id = case.body.get("dem_id") if isinstance(case.body, dict) else None
        real = {"dem_id": dem_id if dem_id in self.told else self.known["dem_id"][0]}
        examples = model.get("examples", [])
        if examples and self.chance.random() < 0.5:
            case.body = {**self.chance.choice(examples), **CHANGES.get(name, {})}
        if isinstance(case.body, dict) and "dem_id" in model.get("required", ()):
            case.body |= real
        case.headers = {**(case.headers or {}), "Prefer": "wait=5"}

    def _model_of(self, case: schemathesis.Case) -> tuple[str, dict[str, Any]]:
        content = case.operation.definition.raw.get("requestBody", {}).get("content", {})
        name = content.get("application/json", {}).get("schema", {}).get("$ref", "").rsplit("/", 1)[-1]
        return name, self.document["components"]["schemas"].get(name, {})

    def count(self, response: Response, case: schemathesis.Case) -> None:
        self.cases += 1
        self.statuses[response.status_code] += 1
        self.operations[case.operation.label] += 1
        if response.status_code < 300:  # of what is not there, the id that was asked for is told
            self.answered.add(case.operation.label)
            self.told.update(ID.findall(response.content[:MOST_BYTES].decode("ascii", "replace")))
            if case.method.upper() == "POST" and "location" in response.headers:
                path, _, made = response.headers["location"][0].rpartition("/")
                self.made.setdefault(path, []).append(made)

    def note(self, failed: Failure | FailureGroup, response: Response, case: schemathesis.Case) -> None:
        for one in failed.exceptions if isinstance(failed, FailureGroup) else (failed,):
            words = f"{case.operation.label}: {getattr(one, 'title', type(one).__name__)}"
            self.failures[words] += 1
            told = f"{one}\n  {case.as_curl_command()[:600]}\n  {response.status_code} {response.content[:400]!r}"
            self.examples.setdefault(words, told)


def one_of_each(server: Server, document: dict[str, Any], known: dict[str, list[str]]) -> dict[str, list[str]]:
    """The id of a job of each product by its path, asked for as the document's example does."""
    made: dict[str, list[str]] = {}
    for product in PRODUCTS.values():
        name = product.asked.__name__
        body = {**document["components"]["schemas"][name]["examples"][0], **CHANGES.get(name, {})}
        body |= {"dem_id": known["dem_id"][0]} if "dem_id" in body else {}
        # one that took too long is there as well, and can be asked about
        where = server.client.post(product.path, json=body).raise_for_status().headers["Location"]
        made[product.path] = [server.until_over(where, PATIENCE_S * len(PRODUCTS))["id"]]
    return made


def asked(asking: Asking, cases: int, seed: int, seconds: float = math.inf) -> None:
    """Ask about so many cases, or as many as there is time for."""
    schema = schemathesis.openapi.from_dict(asking.document)
    # a request may fit its schema and yet make no sense: two heights for one point, a file that is no DEM
    schema.config.checks.positive_data_acceptance.enabled = False
    # a body beyond its limit, or for what is over, is refused before anybody looks at what else is wrong with it
    schema.config.checks.negative_data_rejection.expected_statuses += ["413", "410"]
    runs = itertools.count()
    until, until_s = asking.cases + cases, time.monotonic() + seconds

    def before_call(context: object, case: schemathesis.Case, kwargs: dict[str, Any]) -> None:
        # here, and not in the machine, so that what is sent is looked at again for what is wrong with it
        if case.operation.schema is schema:
            asking.make_real(case)

    class Linked(schema.as_state_machine()):  # type: ignore[misc] # made at run time
        def get_call_kwargs(self, case: schemathesis.Case) -> dict[str, Any]:
            return {"base_url": asking.url, "timeout": PATIENCE_S}

        def after_call(self, response: Response, case: schemathesis.Case) -> None:
            asking.count(response, case)
            super().after_call(response, case)

        def validate_response(self, response: Response, case: schemathesis.Case, **kwargs: Any) -> None:
            try:
                if case.body is NOT_SET and "sample" in (case.query or {}):
                    # the document lets a sample come without a body, and that is taken for one that violates it
                    case.validate_response(response, excluded_checks=[negative_data_rejection])
                else:
                    super().validate_response(response, case, **kwargs)
            except (Failure, FailureGroup) as failed:
                asking.note(failed, response, case)

    GLOBAL_HOOK_DISPATCHER.register_hook_with_name(before_call, "before_call")
    try:
        while asking.cases < until and time.monotonic() < until_s:
            settings = hypothesis.settings(
                max_examples=max(1, min(SCENARIOS, (until - asking.cases) // STEPS)),
                stateful_step_count=STEPS,
                phases=[hypothesis.Phase.generate],
                deadline=None,
                database=None,
                suppress_health_check=list(hypothesis.HealthCheck),
            )
            hypothesis.seed(seed + asking.cases + next(runs))(Linked)
            # what was drawn before may be answered otherwise by now, for much has been made and deleted since
            with contextlib.suppress(hypothesis.errors.FlakyStrategyDefinition):
                Linked.run(settings=settings)
    finally:
        GLOBAL_HOOK_DISPATCHER.unregister(before_call)


def main() -> int:
    """Ask, print what came of it; 1 where anything was not as the document says."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzzing.linked", description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=math.inf, help="ask no longer than about that")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a time-out, too, is told what came of it so far
    document, begun_s = create_app(Settings()).openapi(), time.monotonic()
    with tempfile.TemporaryDirectory() as place, running(Path(place) / "data", max_job_s=60, rehearse="maps") as server:
        known = made_ids(server, Path(place), document)
        made = one_of_each(server, document, known)
        told = {*itertools.chain(*known.values(), *made.values())}
        asking = Asking(server.url, document, known, made, random.Random(arguments.seed), told)
        with contextlib.suppress(KeyboardInterrupt):  # who does not want to wait is told what came of it so far
            asked(asking, arguments.cases, arguments.seed, arguments.seconds)
    for words, times in asking.failures.most_common():
        print(f"{times} × {words}\n  {asking.examples[words]}")
    told = ", ".join(f"{times:,} × {status}" for status, times in sorted(asking.statuses.items()))
    print(
        f"{asking.cases:,} cases of {len(asking.operations)} operations in {time.monotonic() - begun_s:.0f} s, "
        f"{len(asking.answered)} of them with a 2xx: {told}"
    )
    print(f"{asking.failures.total()} failures")
    return 1 if asking.failures else 0


if __name__ == "__main__":
    sys.exit(main())
