# The verbs of this project. Each sets itself up on a machine that has Python >= 3.11 with venv, gcc, make and git;
# the first run creates .venv and compiles the kernels, later runs find the stamps and start at once. To serve takes the
# packages of the product, to develop some more; the demo also leaves all kernels but those of maps, which it compiles.

.PHONY: setup demo test check bench soak fuzz serve page lock sbom audit clean
.DEFAULT_GOAL := setup
# two verbs at once (make -j check demo) must not install into one environment at the same time
.NOTPARALLEL:

VENV := .venv
BIN := $(VENV)/bin
CREATED := $(VENV)/.sightline-created
PRODUCT := $(VENV)/.sightline-product
INSTALLED := $(VENV)/.sightline-installed
WARM := $(VENV)/.sightline-warm
KERNELS := $(wildcard compiled/*.py */kernels/*.py */*/kernels/*.py service/warm_up.py service/products/*/__init__.py)
# the first Python on PATH that is new enough; PYTHON=/path/to/python overrides
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { command -v $$p; break; }; done)

setup: $(INSTALLED) $(WARM)

$(CREATED):
	@test -n "$(PYTHON)" || { echo "Sightline needs Python 3.11 or newer with venv on PATH, or PYTHON=/path/to/python." >&2; exit 2; }
	@echo "Setting up $(VENV) with $(PYTHON); the first time takes a minute or more ..."
	@"$(PYTHON)" -m venv $(VENV)
	@touch $@

# Python writes the bytecode of what it imports when it does; of everything that is installed it would take as long again
# (also where the environment tells it not to: every process would then make it again)
export PYTHONDONTWRITEBYTECODE :=
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --editable

$(PRODUCT): pyproject.toml | $(CREATED)
	@$(INSTALL) .
	@touch $@

$(INSTALLED): pyproject.toml | $(CREATED)
	@$(INSTALL) '.[test,bench]'
	@test $(PRODUCT) -nt pyproject.toml || touch $(PRODUCT)
	@touch $@

$(WARM): $(PRODUCT) $(KERNELS)
	@echo "Compiling the kernels into their cache, which takes a minute or more ..."
	@$(BIN)/sightline warm-up
	@touch $@

demo: $(PRODUCT)
	$(BIN)/sightline demo --out demo-output

test: $(INSTALLED) $(WARM)
	$(BIN)/python -m pytest -n 2 --dist loadfile

check: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(INSTALLED) $(WARM)
	$(BIN)/python -m benchmarks --write docs/benchmarks.md

# hours: maps and epochs under retention, and kills at random moments; SOAK='--maps 200 --kills 10' for less
soak: $(INSTALLED) $(WARM)
	$(BIN)/python -m benchmarks.service.soak $(SOAK)

# a quarter of an hour: requests with real ids that follow the links of OpenAPI; FUZZ='--cases 500 --seed 7' for others
fuzz: $(INSTALLED) $(WARM)
	$(BIN)/python -m tests.fuzzing.linked $(FUZZ)

serve: $(WARM)
	$(BIN)/sightline serve

# the planner's built files, which are committed: only who changes service/page needs node (20.19 or newer) and npm
page:
	cd service/page && npm ci --ignore-scripts && npm run check && npm test && npm run build

# what exactly is installed, with hashes (docs/operating.md): needs uv, and cyclonedx-py or pip-audit for the list and the audit
LOCK := uv pip compile --quiet --upgrade --generate-hashes --universal --python-version 3.11 --no-annotate \
	--custom-compile-command 'make lock'

lock:
	$(LOCK) pyproject.toml --extra postgres --extra rtk --extra telemetry --output-file locks/product.txt
	$(LOCK) pyproject.toml --extra test --extra bench --constraint locks/product.txt --output-file locks/tests.txt
	$(LOCK) locks/rover.in --constraint locks/product.txt --output-file locks/rover.txt
	$(LOCK) locks/build.in --output-file locks/build.txt

sbom:
	cyclonedx-py requirements locks/product.txt --pyproject pyproject.toml --output-file sbom.json

audit:
	pip-audit --disable-pip --require-hashes --requirement locks/product.txt

clean:
	rm -rf $(VENV) build dist demo-output .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
