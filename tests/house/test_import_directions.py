"""The arrows of the house point one way: terrain <- visibility <- planning, detection <- navigation, service on top."""

from __future__ import annotations

import ast
import itertools
import sys
from pathlib import Path

import pytest

from tests.house.repository import PACKAGES, ROOT, imported_modules, kernel_modules, modules, pyproject

MAY_IMPORT = {
    "compiled": {"compiled"},
    "terrain": {"compiled", "terrain"},
    "gnss": {"compiled", "gnss"},
    "visibility": {"compiled", "terrain", "gnss", "visibility"},
    "detection": {"compiled", "detection"},
    "navigation": {"compiled", "gnss", "detection", "navigation"},
    "planning": {"compiled", "terrain", "gnss", "visibility", "detection", "navigation", "planning"},
    "service": set(PACKAGES),
    "dem_samples": {"terrain", "dem_samples"},
}
NOT_OURS_AT_RUN_TIME = {"tests", "benchmarks", "pytest"}
HTTP_AND_TERMINAL = {"fastapi", "starlette", "uvicorn", "httpx", "cyclopts", "rich", "sqlite3"}
KERNELS_MAY_IMPORT = {"numba", "numpy", "math", "typing"}
HOW_KERNELS_ARE_COMPILED = ("compiled.options", "compiled.vectors")


def top(name: str) -> str:
    return name.split(".")[0]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_only_what_stands_to_its_left(package: str) -> None:
    for module in modules(package):
        names = imported_modules(module)
        ours = {top(name) for name in names} & set(PACKAGES)
        assert ours <= MAY_IMPORT[package], f"{module} imports {ours - MAY_IMPORT[package]}"


@pytest.mark.parametrize("package", PACKAGES)
def test_no_package_imports_tests_or_benchmarks(package: str) -> None:
    for module in modules(package):
        assert not {top(name) for name in imported_modules(module)} & NOT_OURS_AT_RUN_TIME, module


@pytest.mark.parametrize("package", [name for name in PACKAGES if name != "service"])
def test_only_the_service_knows_http_terminals_and_databases(package: str) -> None:
    for module in modules(package):
        assert not {top(name) for name in imported_modules(module)} & HTTP_AND_TERMINAL, module


@pytest.mark.parametrize("module", kernel_modules(), ids=str)
def test_kernels_import_only_numbers_and_other_kernels(module: Path) -> None:
    for name in imported_modules(module):
        if name.startswith(HOW_KERNELS_ARE_COMPILED):
            continue
        if top(name) in PACKAGES:
            assert "kernels" in name.split("."), f"{module} imports {name}, which is no kernel"
        else:
            assert top(name) in KERNELS_MAY_IMPORT, f"{module} imports {name}"


def test_how_kernels_are_compiled_needs_numba_alone() -> None:
    modules = [Path(*name.split(".")).with_suffix(".py") for name in HOW_KERNELS_ARE_COMPILED]
    imported = {top(name) for module in modules for name in imported_modules(module)}
    assert imported - set(sys.stdlib_module_names) == {"numba", "llvmlite"}, "llvmlite is numba's own compiler"


def test_reference_oracles_share_no_code_with_the_product() -> None:
    for module in modules("tests/reference"):
        assert not {top(name) for name in imported_modules(module)} & set(PACKAGES), module


def test_every_library_imported_is_declared_and_every_one_declared_is_imported() -> None:
    imported = {top(name) for package in PACKAGES for module in modules(package) for name in imported_modules(module)}
    third_party = imported - set(PACKAGES) - set(sys.stdlib_module_names)
    renamed = {
        "python-multipart": "python_multipart",
        "pydantic-settings": "pydantic_settings",
        "scikit-image": "skimage",
        "pillow": "PIL",
        "pyserial": "serial",
        "PyJWT": "jwt",
        "prometheus-client": "prometheus_client",
        "opentelemetry-sdk": "opentelemetry",
        "opentelemetry-exporter-otlp-proto-http": "opentelemetry",
    }
    project = pyproject()["project"]
    extras = [names for extra, names in project["optional-dependencies"].items() if extra not in ("test", "bench")]
    asked = [*project["dependencies"], *itertools.chain(*extras)]
    requirements = [requirement.split(";")[0] for requirement in asked]
    names = ["".join(c if c.isalnum() or c in "-_" else " " for c in text).split()[0] for text in requirements]
    declared = {renamed.get(name, name) for name in names}
    brought = {
        "starlette": "fastapi",
        "affine": "rasterio",
        "llvmlite": "numba",
        "pydantic_core": "pydantic",
        "pygeoif": "fastkml",
    }
    assert third_party <= declared | {name for name, by in brought.items() if by in declared}
    unseen = {"websockets", "netCDF4", "serial"}
    assert declared <= third_party | unseen, "uvicorn speaks WebSocket, xarray NetCDF, pymavlink to lines with them"


# what is imported late for another reason
LATE_FOR_SPEED = {
    # OMPL's own process loads its kernels while whoever asks is still preparing the task
    "planning/paths/solving.py": {"planning.paths.turning"},
}


def late_imports(module: Path) -> set[str]:
    """Names of the house that a module imports inside a function, or for the type checker alone."""
    found: set[str] = set()
    for node in ast.walk(ast.parse((ROOT / module).read_text(encoding="utf-8"), str(module))):
        late = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        late = late or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test))
        for inner in ast.walk(node) if late else ():
            if isinstance(inner, ast.Import):
                found.update(alias.name for alias in inner.names if top(alias.name) in PACKAGES)
            elif isinstance(inner, ast.ImportFrom) and (inner.level or top(inner.module or "") in PACKAGES):
                found.add("." * inner.level + (inner.module or ""))
    return found


@pytest.mark.parametrize("package", [name for name in PACKAGES if name != "service"])
def test_no_late_import_dodges_a_circle(package: str) -> None:
    found = {module.as_posix(): late for module in modules(package) if (late := late_imports(module))}
    assert found == {module: late for module, late in LATE_FOR_SPEED.items() if module.startswith(f"{package}/")}
