"""The container image and the project's verbs have the properties that people rely on."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
import tomllib
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from service.settings import Settings
from tests.house.repository import PACKAGES, ROOT, pyproject

VERBS = ("setup", "demo", "test", "check", "bench", "serve")


def dockerfile_stages() -> list[list[tuple[str, str]]]:
    """The (instruction, argument) pairs of each build stage, continuation lines joined, comments left out."""
    lines = (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()
    text = "\n".join(line for line in lines if not line.lstrip().startswith("#")).replace("\\\n", " ")
    instructions = [line.split(None, 1) for line in text.splitlines() if line.strip()]
    stages: list[list[tuple[str, str]]] = []
    for name, argument in instructions:
        if name == "FROM":
            stages.append([])
        if stages:
            stages[-1].append((name, argument))
    return stages


def arguments(stage: list[tuple[str, str]], instruction: str) -> list[str]:
    return [argument for name, argument in stage if name == instruction]


def test_the_image_is_built_in_two_stages_and_the_last_takes_only_the_environment() -> None:
    builder, runtime = dockerfile_stages()
    assert arguments(builder, "FROM")[0].endswith("AS builder")
    assert arguments(runtime, "COPY") == ["--from=builder /opt/sightline /opt/sightline"]


def test_the_image_runs_as_a_user_without_rights() -> None:
    runtime = dockerfile_stages()[-1]
    users = arguments(runtime, "USER")
    assert users == ["sightline"]
    last_command = max(index for index, (name, _) in enumerate(runtime) if name == "CMD")
    assert runtime.index(("USER", "sightline")) < last_command


def test_the_image_compiles_its_kernels_as_the_user_that_runs_them() -> None:
    runtime = dockerfile_stages()[-1]
    assert runtime.index(("USER", "sightline")) < runtime.index(("RUN", "sightline warm-up"))
    environment = " ".join(arguments(runtime, "ENV"))
    assert "NUMBA_CACHE_DIR=" in environment
    assert "libgomp1" in " ".join(arguments(runtime, "RUN"))


def test_the_image_listens_outside_the_container_only_by_its_own_setting() -> None:
    runtime = dockerfile_stages()[-1]
    environment = " ".join(arguments(runtime, "ENV"))
    assert "SIGHTLINE_HOST=0.0.0.0" in environment
    assert arguments(runtime, "EXPOSE") == ["8000"]
    assert "SIGHTLINE_PORT=8000" in environment
    assert arguments(runtime, "VOLUME") == ["/data"]


def test_the_image_is_healthy_when_its_service_is_ready_at_the_port_that_was_set() -> None:
    (check,) = arguments(dockerfile_stages()[-1], "HEALTHCHECK")
    command = json.loads(check.partition("CMD ")[2])
    asked: list[str] = []

    class Answering(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_response(200 if len(asked) == 1 else 503)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answering) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        environment = {**os.environ, "SIGHTLINE_PORT": str(server.server_port)}
        ended = [
            subprocess.run([sys.executable, *command[1:]], env=environment, capture_output=True).returncode
            for _ in range(2)
        ]
        server.shutdown()
        thread.join()
    assert (ended, asked) == ([0, 1], ["/ready", "/ready"])


def test_every_setting_that_the_image_makes_exists() -> None:
    environment = " ".join(arguments(dockerfile_stages()[-1], "ENV"))
    made = {name.lower() for name in re.findall(r"SIGHTLINE_(\w+)=", environment)}
    assert made == {"host", "port", "data_folder"}
    assert made <= set(Settings.model_fields)


def test_every_package_reaches_the_image() -> None:
    builder = dockerfile_stages()[0]
    copied = {argument.split()[0] for argument in arguments(builder, "COPY")}
    assert set(PACKAGES) <= copied
    let_in = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert {f"!{package}" for package in PACKAGES} <= set(let_in)


def test_whatever_the_image_is_built_from_is_there_and_is_let_in() -> None:
    builder = dockerfile_stages()[0]
    copied = [source.rstrip("/") for argument in arguments(builder, "COPY") for source in argument.split()[:-1]]
    let_in = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert copied
    assert [source for source in copied if not (ROOT / source).exists() or f"!{source}" not in let_in] == []
    # what its commands and the wheel's own description name lies within that
    project = pyproject()["project"]
    named = {*re.findall(r"--requirement (\S+)", " ".join(arguments(builder, "RUN"))), project["readme"]}
    named |= set(project.get("license-files", ()))
    assert len(named) > 1
    for name in named:
        assert (ROOT / name).is_file(), name
        assert any(name == source or name.startswith(f"{source}/") for source in copied), name


def test_the_image_holds_no_secret() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert not re.search(r"(?i)password|secret|token|api_?key|credential", text)


def commands_on_a_clean_clone(verb: str) -> str:
    """What make would run for a verb where nothing is set up, in order."""
    dry_run = ["make", "--dry-run", "--always-make", verb]
    return subprocess.run(dry_run, cwd=ROOT, capture_output=True, check=True, text=True).stdout


@pytest.mark.parametrize("verb", VERBS)
def test_make_knows_the_verb_and_installs_once_before_it(verb: str) -> None:
    commands = commands_on_a_clean_clone(verb)
    assert commands.index("-m venv") < commands.index("pip install")
    if verb not in ("serve", "demo"):
        assert "pip install --quiet --disable-pip-version-check --no-compile --editable '.[test,bench]'" in commands


@pytest.mark.parametrize(("verb", "compiles"), [("demo", False), ("serve", True)])
def test_those_who_only_use_the_product_install_no_tools_of_developers(verb: str, compiles: bool) -> None:
    commands = commands_on_a_clean_clone(verb)
    assert commands.count("pip install") == 1
    assert "[test" not in commands
    # the demo compiles the little that it asks for itself
    assert ("sightline warm-up" in commands) is compiles


@pytest.mark.parametrize("verb", ["setup", "test", "bench"])
def test_developers_and_their_tests_find_every_kernel_compiled(verb: str) -> None:
    commands = commands_on_a_clean_clone(verb)
    assert commands.index("[test,bench]") < commands.index("sightline warm-up")


def test_two_verbs_at_once_do_not_install_into_one_environment_at_the_same_time() -> None:
    assert "\n.NOTPARALLEL:\n" in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_what_pip_leaves_uncompiled_is_kept_once_it_is_imported() -> None:
    # machines that build images often tell Python to write no bytecode; each process would compile all packages anew
    makefile = "include Makefile\ntold:\n\t@echo told=$$PYTHONDONTWRITEBYTECODE"
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    # make test runs this, and a make within make says where it is
    make = ["make", "--no-print-directory", "--file", "-", "told"]
    said = subprocess.run(
        make, cwd=ROOT, env=environment, input=makefile, capture_output=True, check=True, text=True
    ).stdout
    assert "--no-compile" in (ROOT / "Makefile").read_text(encoding="utf-8")
    assert said == "told=\n"


def test_the_image_carries_bytecode_since_the_user_that_runs_it_cannot_write_beside_the_packages() -> None:
    builder, runtime = dockerfile_stages()
    assert "--no-compile" not in " ".join(arguments(builder, "RUN"))
    assert "/opt/sightline" not in " ".join(arguments(runtime, "RUN"))


def test_continuous_integration_runs_the_verbs_of_the_readme() -> None:
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    text = script.read_text(encoding="utf-8")
    assert text.startswith("#!/usr/bin/env bash\n")
    assert "set -euo pipefail" in text
    assert text.index("make check") < text.index("make test")
    assert "make test" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_warnings_are_errors_and_typing_is_strict() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    assert settings["pytest"]["ini_options"]["filterwarnings"][0] == "error"
    assert settings["mypy"]["strict"] is True
    assert set(settings["mypy"]["packages"]) == {*PACKAGES, "benchmarks"}
