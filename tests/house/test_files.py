"""What every file of the project has in common: small, portable, and in step with its version."""

from __future__ import annotations

import re
from collections import Counter

import pytest

from service.cli.app import COMMANDS
from service.products.registry import PRODUCTS
from service.settings import Settings
from tests.house.repository import PACKAGES, ROOT, project_files, pyproject

LONGEST_FILE = 300
MOST_MODULES = 20  # of a folder
LONGER_FILES: dict[str, str] = {}  # path: why there is no second subject in it

TEXT = {".py", ".md", ".toml", ".txt", ".cfg", ".yml", ".yaml", ".json", ".js", ".css", ".html", ""}

# spelt so that this file does not find itself
NOT_PORTABLE = {
    "a path of one machine": r"(?<![\w.])/(?:wor[k]|roo[t]|hom[e]/(?!sightline)\w+|User[s]|mn[t])/",
    "a private package index": r"--(?:extra-)?inde[x]-url|--find-link[s]|trusted-hos[t]",
    "a private host": r"https?://[\w.-]+\.(?:loca[l]|interna[l]|cor[p]|la[n])\b",
    "a private address": r"\b(?:10\.\d+|192\.168|172\.(?:1[6-9]|2\d|3[01]))\.\d+\.\d+\b",
}


def test_no_python_file_is_longer_than_the_house_allows() -> None:
    lengths = {
        path.as_posix(): len((ROOT / path).read_text(encoding="utf-8").splitlines())
        for path in project_files()
        if path.suffix == ".py"
    }
    too_long = {path: lines for path, lines in lengths.items() if lines > LONGEST_FILE and path not in LONGER_FILES}
    assert too_long == {}, "is there a second subject in it?"
    assert set(LONGER_FILES) <= {path for path, lines in lengths.items() if lines > LONGEST_FILE}


def test_no_folder_holds_more_modules_than_a_reader_takes_in() -> None:
    folders = Counter(
        path.parent.as_posix()
        for path in project_files()
        if path.suffix == ".py" and path.name != "__init__.py" and path.parts[0] in {*PACKAGES, "benchmarks"}
    )
    assert {folder: count for folder, count in folders.items() if count > MOST_MODULES} == {}, (
        "which of them are a room?"
    )


@pytest.mark.parametrize("what", NOT_PORTABLE)
def test_no_file_carries(what: str) -> None:
    found = []
    for path in project_files():
        if path.suffix not in TEXT:
            continue
        text = (ROOT / path).read_text(encoding="utf-8", errors="replace")
        found += [f"{path}: {match.group()}" for match in re.finditer(NOT_PORTABLE[what], text)]
    assert found == []


def test_no_large_file_is_tracked() -> None:
    large = {str(path): (ROOT / path).stat().st_size for path in project_files()}
    assert {path: size for path, size in large.items() if size > 1_500_000} == {}


def test_the_newest_entry_of_the_changelog_is_the_version_of_the_distribution() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - (?:unreleased|\d{4}-\d{2}-\d{2})$", changelog, re.MULTILINE)
    assert versions[0] == pyproject()["project"]["version"]
    assert versions == sorted(versions, key=lambda version: [int(part) for part in version.split(".")], reverse=True)


def test_decisions_are_numbered_once_and_listed_in_the_index() -> None:
    pages = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    numbers = [page.name.split("-")[0] for page in pages]
    assert numbers == [f"{number:04d}" for number in range(1, len(pages) + 1)]
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    assert [page.name for page in pages if f"decisions/{page.name}" not in index] == []


def test_every_setting_of_the_service_is_documented_and_no_other() -> None:
    page = (ROOT / "docs" / "http.md").read_text(encoding="utf-8")
    documented = set(re.findall(r"^\| `SIGHTLINE_(\w+)`", page, re.MULTILINE))
    assert documented == {name.upper() for name in Settings.model_fields}


def test_every_product_and_every_command_stands_in_the_tables_of_the_documents() -> None:
    readme, http, cli = (
        (ROOT / page).read_text(encoding="utf-8") for page in ("README.md", "docs/http.md", "docs/cli.md")
    )
    paths = [product.path for product in PRODUCTS.values()]
    assert [path for path in paths if f"`{path}`" not in readme] == []
    assert [path for path in paths if f"| `POST {path}` |" not in http] == []
    assert [name for name in COMMANDS if not re.search(rf"^\| `{name}[ `]", cli, re.MULTILINE)] == []


def test_every_relative_link_in_the_documents_leads_somewhere() -> None:
    broken = []
    for path in project_files():
        if path.suffix != ".md":
            continue
        text = (ROOT / path).read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
            if "://" not in target and not (ROOT / path.parent / target).exists():
                broken.append(f"{path}: {target}")
    assert broken == []


def test_every_file_and_folder_of_ours_that_the_documents_name_is_there() -> None:
    ours = re.compile(rf"`((?:{'|'.join([*PACKAGES, 'tests', 'benchmarks', 'docs'])})/[\w./-]*)`")
    gone = []
    for path in project_files():
        if path.suffix == ".md":
            named = ours.findall((ROOT / path).read_text(encoding="utf-8"))
            gone += [f"{path}: {name}" for name in named if not ((ROOT / name).exists() or "__pycache__" in name)]
    assert gone == []


def test_every_exemption_from_types_and_from_ruff_says_why() -> None:
    bare = re.compile(r"#\s*(?:type:\s*ignore|noqa)\b(?:\[[\w, -]+\]|:\s*[A-Z0-9, ]+)?\s*$")
    found = [
        f"{path.as_posix()}:{number}"
        for path in project_files()
        if path.suffix == ".py"
        for number, line in enumerate((ROOT / path).read_text(encoding="utf-8").splitlines(), start=1)
        if bare.search(line)
    ]
    assert found == []
