# Two commands on a fresh machine with Python >= 3.11:
#   make reproduce   the main job, on the embedded default (or JAXSH_DATA=folder)
#   make test        the tests, without the slow ones
# Also: make report (all results on a page), make readme (README's figures from results), make
# test-slow (those, and the examples of the docstrings), make test-all (both), make check
# (lint, types), make docs (the pages, built strictly), make test-oldest (the oldest JAX that is
# supported), make test-newest (the newest Python here, and its JAX), make test-minimal (without the
# packages that only some functions need), make package (wheel and sdist), make bench (beside the
# peers), make gpu (times of the device that JAX takes beside its limits, as JSON), make fuzz (changed
# files of every format, a million of each: FUZZ="--inputs 10000 --formats obj glb" for fewer), make
# clean.

PYTHON ?= python3
VENV ?= .venv
BENCH_VENV ?= .venv-bench
GPU_VENV ?= .venv-gpu
OLDEST_VENV ?= .venv-oldest
NEWEST_VENV ?= .venv-newest
PRESET ?= quick
# JAX with CUDA where there is NVIDIA's driver.
GPU_JAX ?= $(if $(shell command -v nvidia-smi 2> /dev/null),jax[cuda12],jax)
bin := $(VENV)/bin
# loadfile: what one file has traced serves its other tests.
PARALLEL ?= -n auto --dist loadfile
# Unoptimized machine code, by XLA's older way for loops on the CPU where this JAX still knows it: that
# runs slower and compiles much faster, which is most of what tests do. Examples of docstrings, the oldest
# JAX, test-all and a plain pytest go without.
QUICK_COMPILE ?= --xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false

.PHONY: environments reproduce report readme test test-slow test-all test-oldest test-newest test-minimal check docs package bench gpu fuzz clean

# An environment, of another Python where one is named. Groups of dependencies need pip >= 25.1.
define environment
	$(or $(2),$(PYTHON)) -m venv $(1)
	$(1)/bin/python -m pip install --quiet --upgrade pip
endef

$(VENV)/installed: pyproject.toml
	@echo "Installing into $(VENV), once: 1.8 GB, some minutes"
	$(call environment,$(VENV))
	$(bin)/python -m pip install --quiet --editable . --group check
	touch $@

# A module in an environment, pytest where none is named, with those of the flags above that its JAX knows.
define quickly
flags=""; for flag in $(QUICK_COMPILE); do \
		XLA_FLAGS="$$flag" $(1)/bin/python -c "import jax; jax.devices()" 2> /dev/null && flags="$$flags $$flag"; \
	done; XLA_FLAGS="$(XLA_FLAGS) $$flags" $(1)/bin/python -m $(or $(2),pytest $(PARALLEL))
endef

# Peers hold JAX back, so they get an environment of their own.
$(BENCH_VENV)/installed: pyproject.toml
	$(call environment,$(BENCH_VENV))
	$(BENCH_VENV)/bin/python -m pip install --quiet --editable . --group peers
	touch $@

# With sphericart's kernels where it has some for a JAX that we take.
$(GPU_VENV)/installed: pyproject.toml
	$(call environment,$(GPU_VENV))
	$(GPU_VENV)/bin/python -m pip install --quiet --editable . --group test --group peers "$(GPU_JAX)" || \
		$(GPU_VENV)/bin/python -m pip install --quiet --editable . --group test "$(GPU_JAX)"
	touch $@

# The floors of pyproject.toml as they stand: tools/floors.py prints them.
$(OLDEST_VENV)/installed: pyproject.toml tools/floors.py
	$(call environment,$(OLDEST_VENV))
	$(PYTHON) tools/floors.py > $(OLDEST_VENV)/floors.txt
	$(OLDEST_VENV)/bin/python -m pip install --quiet --constraint $(OLDEST_VENV)/floors.txt --editable . --group test
	touch $@

# Beside the others only where this machine has a newer Python: JAX leaves old ones behind.
$(NEWEST_VENV)/installed: pyproject.toml tools/newest_python.py
	$(call environment,$(NEWEST_VENV),$$($(PYTHON) tools/newest_python.py))
	$(NEWEST_VENV)/bin/python -m pip install --quiet --editable . --group test
	touch $@

environments: $(VENV)/installed $(OLDEST_VENV)/installed $(NEWEST_VENV)/installed

reproduce: $(VENV)/installed
	$(bin)/python -m experiments run first_light environment --preset $(PRESET)

# ALL=--all first runs what is missing or stale.
report: $(VENV)/installed
	$(bin)/python -m experiments report $(ALL)

readme: $(VENV)/installed
	$(bin)/python -m experiments readme

test: $(VENV)/installed
	$(call quickly,$(VENV)) tests

test-slow: $(VENV)/installed
	$(bin)/python -m pytest $(PARALLEL) jaxsh
	$(call quickly,$(VENV)) -m slow tests

test-all: $(VENV)/installed
	$(bin)/python -m pytest $(PARALLEL) -m ""

test-oldest: $(OLDEST_VENV)/installed
	$(OLDEST_VENV)/bin/python -m pytest $(PARALLEL) tests/harmonics tests/sphere tests/transfer/test_diffuse.py tests/sky/test_preetham.py

test-newest: $(NEWEST_VENV)/installed
	$(call quickly,$(NEWEST_VENV)) tests/harmonics tests/geometry/test_mesh.py tests/inverse tests/*/test_sharding.py

test-minimal: $(VENV)/installed
	$(bin)/python -m pytest -m "" tests/test_import.py -k without

check: $(VENV)/installed
	$(bin)/ruff check .
	$(bin)/ruff format --check .
	$(bin)/basedpyright --pythonpath $(bin)/python

# Open site/index.html. The notebooks are executed, unless .cache has it already.
docs: export NO_MKDOCS_2_WARNING = 1
docs: $(VENV)/installed
	$(call quickly,$(VENV),mkdocs build --strict)

package: $(VENV)/installed
	rm -rf dist
	$(bin)/python -m build
	$(bin)/python tools/check_package.py dist

bench: $(BENCH_VENV)/installed
	$(BENCH_VENV)/bin/python -m benchmarks

# Only JSON on the standard output: GPU="--only glossy" for some cases.
gpu: $(GPU_VENV)/installed
	@$(GPU_VENV)/bin/python -m benchmarks.gpu $(GPU)

# Beside other readers, where there are wheels of them.
fuzz: $(VENV)/installed
	-$(bin)/python -m pip install --quiet --group fuzz
	$(bin)/python tests/fuzz $(FUZZ)

clean:
	rm -rf $(VENV) $(BENCH_VENV) $(GPU_VENV) $(OLDEST_VENV) $(NEWEST_VENV) .cache dist results site
