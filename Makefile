# Everything runs in .venv, which is created from constraints.txt at first use. `make` alone lists the commands.

PYTHON ?= python3.11
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest --numprocesses 4 --no-loadscope-reorder
unexport PYTHONDONTWRITEBYTECODE  # compiled once, not by each process of the tests
DENO := DENO_DIR=.venv/deno DENO_NO_UPDATE_CHECK=1 $(BIN)/deno

help:  ## list the commands
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

demo: .venv/installed  ## tune a toy and a quadruped with every strategy, and draw the curves
	$(BIN)/gaplab demo

serve: .venv/installed  ## start the service on http://127.0.0.1:8000, with its workers
	$(BIN)/gaplab serve

test: .venv/prepared  ## run the tests that every change must pass: ten minutes on two quiet cores
	$(PYTEST)

test-all: .venv/prepared  ## run all tests, as before a release: also on Postgres, and the documents as written
	$(PYTEST) --all

lint: .venv/installed-dev  ## check style, types, dependencies and the imports between layers
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(DENO) lint --quiet
	$(DENO) check --quiet api/dashboard
	$(BIN)/python -m pip check --disable-pip-version-check
	$(BIN)/python -m pytest tests/unit/test_architecture.py tests/unit/test_dependencies.py

bench: .venv/installed-dev  ## measure speeds, as ratios within one run
	$(BIN)/python -m benchmarks

docs: .venv/installed-dev  ## generate docs/reference/ from the code
	$(BIN)/python -m docs.generate

pictures: .venv/prepared  ## take the pictures of docs/ from the page as it is now
	$(BIN)/python -m docs.take_pictures

soak: .venv/installed-dev  ## inject a thousand random faults into the real service and check every acknowledgement: an hour and a half
	$(BIN)/python -m tests.soak $(if $(FAULTS),--faults $(FAULTS)) $(if $(SEED),--seed $(SEED))

clean:  ## remove the environment and caches; results stay
	rm -rf .venv build dist src/*.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis

.venv/bin/pip:
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/pip
	@echo "Installing gaplab and its libraries in .venv; this takes one to five minutes."
	$(BIN)/pip install --quiet --quiet --disable-pip-version-check --constraint constraints.txt --editable .
	touch $@

.venv/installed-dev: .venv/installed
	$(BIN)/pip install --quiet --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	touch $@

.venv/prepared: .venv/installed-dev
	$(BIN)/python -m tests.e2e.prepare_machine
	touch $@

.PHONY: help demo serve test test-all lint bench docs pictures soak clean
