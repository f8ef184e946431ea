# Everything runs in .venv, made from constraints.txt at first use. `make` alone lists what there is.

PYTHON ?= python3.11
BIN := .venv/bin
DENO := DENO_DIR=.venv/deno DENO_NO_UPDATE_CHECK=1 $(BIN)/deno

help:  ## this list
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

demo: .venv/installed  ## tune a toy and a quadruped with every strategy, and see the curves
	$(BIN)/gaplab demo

serve: .venv/installed  ## the service on http://127.0.0.1:8000, with its workers
	$(BIN)/gaplab serve

test: .venv/prepared  ## all tests, on SQLite and on a real Postgres, the page's in a real Chromium
	$(BIN)/python -m pytest --numprocesses logical --maxprocesses 4 --dist loadfile --no-loadscope-reorder

lint: .venv/installed-dev  ## style, types, dependencies and the arrows between the layers
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/mypy --config-file tests/mypy.ini
	$(DENO) lint --quiet
	$(DENO) check --quiet api/dashboard
	$(BIN)/python -m pip check --disable-pip-version-check
	$(BIN)/python -m pytest tests/unit/test_architecture.py tests/unit/test_dependencies.py

bench: .venv/installed-dev  ## the table of speeds, as ratios within one run
	$(BIN)/python -m benchmarks

docs: .venv/installed-dev  ## the reference in docs/reference/, written out of the code
	$(BIN)/python -m docs.generate

soak: .venv/installed-dev  ## a thousand random faults on the real service, and whether it kept its word: three quarters of an hour
	$(BIN)/python -m tests.soak $(if $(FAULTS),--faults $(FAULTS)) $(if $(SEED),--seed $(SEED))

clean:  ## remove the environment and what tools cached; results stay
	rm -rf .venv build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis

.venv/bin/pip:
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | .venv/bin/pip
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable .
	touch $@

.venv/installed-dev: .venv/installed
	$(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	touch $@

.venv/prepared: .venv/installed-dev
	$(BIN)/python -m tests.e2e.prepare_machine
	touch $@

.PHONY: help demo serve test lint bench docs soak clean
