# The verbs of this project. Each sets itself up on a machine that has Python >= 3.11 with venv, gcc, make and git;
# the first run creates .venv and compiles the kernels, later runs find the stamps and start at once.

.PHONY: setup demo test check bench serve clean
.DEFAULT_GOAL := setup

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.sightline-installed
WARM := $(VENV)/.sightline-warm
KERNELS := $(wildcard */kernel_*.py */kernels.py */kernels/*.py service/warm_up.py)
# the first Python on PATH that is new enough; PYTHON=/path/to/python overrides
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { command -v $$p; break; }; done)

setup: $(WARM)

$(INSTALLED): pyproject.toml
	@test -n "$(PYTHON)" || { echo "Sightline needs Python 3.11 or newer with venv on PATH, or PYTHON=/path/to/python." >&2; exit 2; }
	@echo "Setting up $(VENV) with $(PYTHON); the first time takes a minute or more ..."
	@"$(PYTHON)" -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,bench]'
	@touch $@

$(WARM): $(INSTALLED) $(KERNELS)
	@echo "Compiling the kernels into their cache, which takes a minute or more ..."
	@$(BIN)/sightline warm-up
	@touch $@

demo: $(WARM)
	$(BIN)/sightline demo --out demo-output

test: $(WARM)
	$(BIN)/python -m pytest -n 2 --dist loadfile

check: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(WARM)
	$(BIN)/python -m benchmarks --write docs/benchmarks.md

serve: $(WARM)
	$(BIN)/sightline serve

clean:
	rm -rf $(VENV) build dist demo-output .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
