"""The examples of README and docs run as they stand: Python, commands, and HTTP against a real service."""

from __future__ import annotations

import doctest
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.cli.own_service import running_service
from tests.house.repository import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), ROOT / "CONTRIBUTING.md"]
# what needs a machine, an engine or a terminal of its own; the verbs are tested by being run
NOT_RUN_HERE = ("make ", "git clone ", "docker ", "cd ", "sightline serve", "sightline demo", "sightline store")
RUN_HERE = ("sightline ", "curl ", "python ", "ls ", "cat ")
KEPT = re.compile(r"[a-z]+=\$\((?:python|curl) ")  # something of an answer, under a name, for the next command
SERVICE = "http://127.0.0.1:8000"


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def commands_and_output(block: str) -> tuple[list[str], str]:
    """The commands of a console block, continued lines joined and comments dropped, and the output it shows."""
    commands: list[str] = []
    output: list[str] = []
    for line in block.replace("\\\n", " ").splitlines():
        if line.startswith("$ "):
            commands.append(re.sub(r"\s+# .*$", "", line[2:]))
        elif commands and commands[-1].count("'") % 2:
            commands[-1] += "\n" + line  # a quoted body goes on
        else:
            output.append(line)
    return commands, "\n".join(output) + "\n" if output else ""


def pages_with(language: str) -> list[Path]:
    return [page for page in PAGES if blocks(page, language)]


def page_id(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", pages_with("python"), ids=page_id)
def test_the_python_of_a_page_runs_from_top_to_bottom(page: Path, tmp_path: Path) -> None:
    program = "\n".join(blocks(page, "python"))
    run = subprocess.run([sys.executable, "-W", "error", "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("page", pages_with("console"), ids=page_id)
def test_every_command_shown_is_one_that_a_test_knows(page: Path) -> None:
    for block in blocks(page, "console"):
        for command in commands_and_output(block)[0]:
            assert command.startswith((*RUN_HERE, *NOT_RUN_HERE)) or KEPT.match(command), command


@pytest.fixture(scope="module")
def service_address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with running_service(tmp_path_factory.mktemp("service")) as client:
        yield str(client.base_url).rstrip("/")


@pytest.mark.timeout(1200)  # a page may show a dozen commands, each a process of its own
@pytest.mark.parametrize("page", pages_with("console"), ids=page_id)
def test_the_commands_of_a_page_run_and_print_what_it_shows(
    page: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    shown = [commands_and_output(block) for block in blocks(page, "console")]
    script, expected = "", ""
    for commands, output in shown:
        runnable = [command for command in commands if not command.startswith(NOT_RUN_HERE)]
        if runnable:
            script += "\n".join([*runnable, ""])
            expected += output or "...\n"
    if not script:
        return
    if "curl " in script:
        if shutil.which("curl") is None:
            pytest.skip("curl is not installed")
        script = script.replace(SERVICE, request.getfixturevalue("service_address"))
    (tmp_path / "dem_samples").symlink_to(ROOT / "dem_samples")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "COLUMNS": "120"}
    run = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert doctest.OutputChecker().check_output(
        expected, run.stdout, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    ), run.stdout
