# One environment (.venv) and one build folder (build); each target does all the set-up that it needs.
SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out/demo
LEVEL ?= $(if $(filter x86_64 amd64,$(shell uname -m)),v3,baseline)
CORE := $(shell find cpp/include cpp/src src/dynakin/bindings -name '*.?pp') CMakeLists.txt pyproject.toml \
  $(shell find src/dynakin -name __init__.py)  # a new package must be made known to the editable install
export PATH := $(CURDIR)/$(BIN):$(PATH)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
unexport PYTHONDONTWRITEBYTECODE  # tests start many processes; each would compile all modules again
# pip compiles there, and the C++ tests link the same core.
export SKBUILD_BUILD_DIR := build/package
# Neighbours run in one process, so that what they share is made once; who is done takes half of what another has left.
# A process a core: a second thread in each would only wait on the others' cores (docs/design.md).
PYTEST := OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n logical --maxprocesses 8 --dist worksteal --durations 20 --durations-min 5

.PHONY: all demo live check test test-python test-cpp test-cpp-install test-cpp-sanitize test-cpp-address test-cpp-thread lint stubs bench peers nightly clean prerequisites
all: $(VENV)/.built

prerequisites:
	@missing=""; \
	command -v $(PYTHON) >/dev/null || missing="$$missing python3"; \
	$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || missing="$$missing python3-venv"; \
	$(PYTHON) -c 'import os, sysconfig, sys; sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))' 2>/dev/null || missing="$$missing python3-dev"; \
	command -v g++ >/dev/null || missing="$$missing g++"; \
	if [ -n "$$missing" ]; then echo "missing:$$missing. Install with: apt-get install$$missing" >&2; exit 1; fi; \
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$(PYTHON) is $$($(PYTHON) --version 2>&1), expected Python 3.11 or newer (set PYTHON=...)" >&2; exit 1; }

# What the build needs, then the package itself with what it runs on.
$(VENV)/.env: | prerequisites
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet "scikit-build-core>=0.11" "nanobind>=3" "cmeel-eigen>=3.4" cmake ninja
	@touch $@

ifeq ($(wildcard $(SKBUILD_BUILD_DIR)/CMakeCache.txt),)
.PHONY: $(VENV)/.built  # the build folder was removed: made again
endif
$(VENV)/.built: $(VENV)/.env $(CORE)
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable .
	@$(BIN)/python -m compileall -q src  # as an install does that is not editable: else each start may compile all
	@touch $@

$(VENV)/.dev: $(VENV)/.built
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable ".[dev]"
	@touch $@

# What the viewer and the capture systems need; `make live` then shows a simulated person.
$(VENV)/.live: $(VENV)/.built
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable ".[live]"
	@touch $@

live: $(VENV)/.live
	$(BIN)/dynakin live --source simulate:squat --view

demo: $(VENV)/.built
	$(BIN)/dynakin demo -o $(OUT)

# Three tiers (CONTRIBUTING): after each change, before each merge, each night.
check: $(VENV)/.dev
	+@$(MAKE) --no-print-directory -j2 --output-sync=target lint test-cpp
	$(PYTEST) tests/core tests/oracle tests/recordings

test: $(VENV)/.dev
	+@$(MAKE) --no-print-directory -j2 --output-sync=target lint test-cpp-install
	+@$(MAKE) --no-print-directory test-python

test-python: $(VENV)/.dev
	$(PYTEST)

# What is long: sanitizers, real recordings at full length, processes killed, other software, some 25,000 damaged files.
nightly: test-cpp-sanitize
	$(PYTEST) -m nightly --dist load
	+@$(MAKE) --no-print-directory peers

# The core's own tests: as the package has it (nothing may be allocated in a step), and under the sanitizers: of memory
# and undefined behaviour, and of races between threads.
test-cpp-sanitize: test-cpp-address test-cpp-thread
test-cpp: BUILD = $(SKBUILD_BUILD_DIR)
test-cpp-address test-cpp-thread: BUILD = build/$(subst test-,,$@)
test-cpp-address: SANITIZERS = address,undefined
test-cpp-thread: SANITIZERS = thread
test-cpp test-cpp-address test-cpp-thread: $(VENV)/.dev
	@$(if $(SANITIZERS),$(BIN)/cmake -S . -B $(BUILD) -G Ninja -DDYNAKIN_PYTHON=OFF -DDYNAKIN_SANITIZE=$(SANITIZERS) \
	  -DCMAKE_PREFIX_PATH="$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" >/dev/null)
	@MAKEFLAGS= $(BIN)/cmake --build $(BUILD) --target core_tests >$(BUILD)/tests.log || { cat $(BUILD)/tests.log; exit 1; }
	@$(BIN)/ctest --test-dir $(BUILD) --output-on-failure

# The core as others take it: installed, and examples/cpp built against that.
test-cpp-install: test-cpp
	@rm -rf build/cpp-example && $(BIN)/cmake --install $(SKBUILD_BUILD_DIR) --component cpp --prefix build/cpp-example/prefix >/dev/null
	@$(BIN)/cmake -S examples/cpp -B build/cpp-example -G Ninja -DCMAKE_BUILD_TYPE=Release \
	  -DCMAKE_PREFIX_PATH="$(CURDIR)/build/cpp-example/prefix;$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" >/dev/null
	@MAKEFLAGS= $(BIN)/cmake --build build/cpp-example >/dev/null
	@$(BIN)/ctest --test-dir build/cpp-example --output-on-failure

# What editors and mypy know of the compiled module; committed, so lint checks that it is up to date.
stubs: $(VENV)/.dev
	$(BIN)/python -m nanobind.stubgen -q -m dynakin.bindings._core -o src/dynakin/bindings/_core.pyi
	$(BIN)/python -m nanobind.stubgen -q -m dynakin.bindings._cpu -o src/dynakin/bindings/_cpu.pyi

lint: $(VENV)/.dev
	@mkdir -p build/stubs
	@for m in _core _cpu; do $(BIN)/python -m nanobind.stubgen -q -m dynakin.bindings.$$m -o build/stubs/$$m.pyi && \
	  diff -u src/dynakin/bindings/$$m.pyi build/stubs/$$m.pyi || { echo "src/dynakin/bindings/$$m.pyi is out of date: run make stubs" >&2; exit 1; }; done
	$(BIN)/ruff check src tests benchmarks examples
	$(BIN)/ruff format --check src tests benchmarks examples
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/clang-format --dry-run --Werror $$(find cpp examples/cpp src/dynakin/bindings -name '*.cpp' -o -name '*.hpp')

bench: $(VENV)/.dev
	$(BIN)/cmake -S . -B build/bench -G Ninja -DDYNAKIN_BENCH=ON -DDYNAKIN_VECTOR=$(LEVEL) -DPython_EXECUTABLE=$(CURDIR)/$(BIN)/python \
	  -DCMAKE_PREFIX_PATH="$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" >/dev/null
	$(BIN)/cmake --build build/bench --target dynakin_bench >/dev/null
	DYNAKIN_VECTOR=$(LEVEL) PYTHONPATH=build/bench $(BIN)/python benchmarks/step.py

peers: $(VENV)/.dev
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable ".[dev,peers]"
	$(BIN)/python -m pytest -m peers
	OMP_NUM_THREADS=1 $(BIN)/python benchmarks/peers.py
	OMP_NUM_THREADS=1 $(BIN)/python benchmarks/end_to_end.py

clean:
	rm -rf build out $(VENV)
