"""The planner's built files: what the sources and the lock build to, small, with the licences of what is in them."""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from service.http.web_page import BUILT

PAGE = BUILT.parent
SOURCES = (
    *("src", "tools", "index.html", "docs.html", "package.json", "package-lock.json", "tsconfig.json"),
    "vite.config.ts",
)
# what a build writes: what users get, and what the stories look at the page with
WRITTEN = ("dist", "testing")


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def digest_of(paths: list[Path]) -> str:
    """SHA-256 over the digests and names of files, as service/page/tools/finish.mjs makes it."""
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(PAGE).as_posix()}" for path in paths]
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


def npm(folder: Path, *words: str) -> None:
    """Run npm there; what it said is told where it fails."""
    program = shutil.which("npm")
    assert program is not None
    done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"npm {' '.join(words)}: {done.stdout[-4000:]}{done.stderr[-4000:]}"


@pytest.fixture(scope="module")
def page_elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page's sources in another folder, without what was built of them, and the packages of the lock."""
    wanted = json.loads((PAGE / "package.json").read_text(encoding="utf-8"))["engines"]["node"]
    if missing := node_lacks(wanted):
        pytest.skip(missing)
    copy = tmp_path_factory.mktemp("build") / "page"
    shutil.copytree(PAGE, copy, ignore=shutil.ignore_patterns("node_modules", *WRITTEN))
    # what the lock names by digest and npm has kept is not asked for again
    npm(copy, "ci", "--ignore-scripts", "--prefer-offline", "--no-update-notifier")
    return copy


def node_lacks(wanted: str) -> str | None:
    """Why this machine cannot build the page; package.json says from which node on: ">=20.19"."""
    least = tuple(int(part) for part in wanted.removeprefix(">=").split("."))
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        return f"no npm here, or no node {wanted}"
    told = subprocess.run([node, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    here = tuple(int(part) for part in re.findall(r"\d+", told))
    return None if here >= least else f"node is {told} here, and the page is built with {wanted}"


def test_the_sources_build_to_the_committed_files_byte_for_byte(page_elsewhere: Path) -> None:
    npm(page_elsewhere, "run", "build")
    for folder in WRITTEN:
        committed, built = (
            {path.relative_to(root / folder).as_posix(): path.read_bytes() for path in files(root / folder)}
            for root in (PAGE, page_elsewhere)
        )
        assert sorted(built) == sorted(committed)
        assert [name for name in built if built[name] != committed[name]] == [], "run make page, and commit its files"


def test_types_and_rules_of_the_sources_hold(page_elsewhere: Path) -> None:
    npm(page_elsewhere, "run", "check")


def test_the_sources_own_tests_pass(page_elsewhere: Path) -> None:
    npm(page_elsewhere, "test")


def test_digests_are_those_of_the_sources_the_lock_and_the_built_files() -> None:
    told = json.loads((BUILT / "digest.json").read_text(encoding="utf-8"))
    sources = [file for name in SOURCES for file in ([PAGE / name] if (PAGE / name).is_file() else files(PAGE / name))]
    assert digest_of(sources) == told["sources"], (
        "the sources have changed since: run make page, and commit what it builds"
    )
    built = [file for file in files(BUILT) if file.name != "digest.json"]
    assert digest_of(built) == told["built"], "the built files were changed by hand: run make page"


def test_the_planner_is_small_and_its_licences_go_with_it() -> None:
    planner = [path for path in files(BUILT) if path.suffix in (".js", ".css", ".html") and "docs" not in path.name]
    assert sum(len(gzip.compress(path.read_bytes())) for path in planner) <= 600_000
    licences = (BUILT / "LICENSES.txt").read_text(encoding="utf-8")
    lock = json.loads((PAGE / "package-lock.json").read_text(encoding="utf-8"))
    shipped = {
        path.split("node_modules/")[-1] for path, entry in lock["packages"].items() if path and not entry.get("dev")
    }
    assert {name for name in shipped if f"## {name} " not in licences} == set()


def test_the_lock_names_versions_and_digests_and_no_host() -> None:
    text = (PAGE / "package-lock.json").read_text(encoding="utf-8")
    assert '"resolved"' not in text
    packages = {path: entry for path, entry in json.loads(text)["packages"].items() if path}
    assert [path for path, entry in packages.items() if not entry.get("integrity")] == []
