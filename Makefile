# Two commands on a fresh machine with Python >= 3.11:
#   make reproduce   the main job, on the embedded default (or JAXSH_DATA=folder)
#   make test        the tests
# Also: make test-all (with the slow ones), make check (lint, types), make bench (beside the peers), make clean.

PYTHON ?= python3
VENV ?= .venv
BENCH_VENV ?= .venv-bench
PRESET ?= quick
bin := $(VENV)/bin

.PHONY: reproduce test test-all check bench clean

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(bin)/python -m pip install --quiet --upgrade pip
	$(bin)/python -m pip install --quiet --editable ".[check]"
	touch $@

# Peers hold JAX back, so they get an environment of their own.
$(BENCH_VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(BENCH_VENV)
	$(BENCH_VENV)/bin/python -m pip install --quiet --upgrade pip
	$(BENCH_VENV)/bin/python -m pip install --quiet --editable ".[peers]"
	touch $@

reproduce: $(VENV)/installed
	$(bin)/python -m experiments run first_light environment --preset $(PRESET)

test: $(VENV)/installed
	$(bin)/python -m pytest -n auto --dist worksteal

test-all: $(VENV)/installed
	$(bin)/python -m pytest -n auto --dist worksteal -m ""

check: $(VENV)/installed
	$(bin)/ruff check .
	$(bin)/ruff format --check .
	$(bin)/basedpyright --pythonpath $(bin)/python

bench: $(BENCH_VENV)/installed
	$(BENCH_VENV)/bin/python -m benchmarks

clean:
	rm -rf $(VENV) $(BENCH_VENV) results
