"""What the house tests look at: the packages, their modules and the files that belong to the project."""

from __future__ import annotations

import ast
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = (
    *("compiled", "terrain", "gnss", "visibility", "detection", "navigation", "planning"),
    *("service", "dem_samples"),
)


def pyproject() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def project_files() -> list[Path]:
    """Every file of the project, relative to its root: tracked, or new and not ignored."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
    if listing.returncode:
        pytest.skip("this is no git checkout, so the project's own files cannot be told from others")
    names = {Path(name) for name in listing.stdout.decode().split("\0") if name}
    return sorted(name for name in names if (ROOT / name).is_file())


def modules(package: str) -> Iterator[Path]:
    """The package's modules, relative to the project's root, without what `make page` installs beside its sources."""
    found = (path.relative_to(ROOT) for path in sorted((ROOT / package).rglob("*.py")))
    return (path for path in found if "node_modules" not in path.parts)


def kernel_modules() -> list[Path]:
    """The modules of kernels, of every package and room."""
    return [module for package in PACKAGES for module in modules(package) if "kernels" in module.parts]


def imported_modules(module: Path) -> set[str]:
    """Dotted absolute names of everything that a module imports, at its top or inside its functions."""
    tree = ast.parse((ROOT / module).read_text(encoding="utf-8"), str(module))
    within = module.parent.parts
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = within[: len(within) - node.level + 1] if node.level else ()
            source = ".".join([*base, *([node.module] if node.module else [])])
            names.update({f"{source}.{alias.name}" for alias in node.names} if node.level else {source})
    return names
