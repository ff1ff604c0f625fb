# make demo: a shipped scene becomes a printable mesh. make test: tests and linters. make wheel: a wheel that needs no OpenVDB.
# make docs: the site, in docs/_build.
# make nightly: the tests with all their cases, 500 random scenes, 200 random hybrids; some hours. make newest, which is part of it:
# the tests on the newest Python that is there.
# make native-tests: unit tests of the native code. make sanitize: all of it under GCC's sanitizers, some minutes.
# All of them set up what is missing first: Debian packages (as root or with sudo) and an own .venv. Debian 12, Ubuntu 24.04.
# Another Python, in a venv of its own: make test PYTHON=python3.13 VENV=.venv-3.13
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)

# The tests of the studio drive a browser; Ubuntu has none as a package, and leaves them out.
BROWSER := $(shell grep -q '^ID=debian' /etc/os-release && echo chromium)
# The compiler, and what it has compiled for another Python; OpenVDB's headers (they include Boost's); Python's headers; what draws
# without a screen, and a screen for the tests of windows.
PACKAGES := g++ ccache cmake ninja-build python3-dev python3-venv libopenvdb-dev libtbb-dev libimath-dev libboost-dev zlib1g-dev doctest-dev \
	libgl1 libegl1 libgl1-mesa-dri libopenvdb-tools xvfb libxtst6 $(BROWSER)
MISSING = $(shell for p in $(PACKAGES); do dpkg -s $$p >/dev/null 2>&1 || echo $$p; done)
NATIVE := CMakeLists.txt $(wildcard cmake/* fracslice/native/* fracslice/native/*/*)

# Compiled modules are kept: tests start hundreds of processes. pip compiles none; few are needed.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test suite native-tests docs nightly newest sanitize lint wheel peers setup packages clean

demo: setup
	mkdir -p out
	$(BIN)/fracslice mesh scenes/mandelbulb.xml -o out/mandelbulb.3mf --report out/mandelbulb.json --picture out/mandelbulb.png
	$(BIN)/fracslice mesh scenes/mandelbulb.xml -o out/mandelbulb.stl --quiet
	@ls -l out/mandelbulb.*

test: setup
	$(MAKE) --jobs 2 --no-print-directory native-tests lint suite

suite: setup
	$(BIN)/python -m pytest -n 2 $(SELECT)

native-tests: packages
	CMAKE_CXX_COMPILER_LAUNCHER=$$(command -v ccache) cmake -S tests/native -B build/native-tests -G Ninja
	cmake --build build/native-tests
	cd build/native-tests && ctest --output-on-failure

# No warning is let through, and nothing of an earlier build is kept.
docs: setup $(VENV)/.docs
	rm -rf docs/_build docs/examples
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet docs docs/_build
	@ls docs/_build/index.html

$(VENV)/.docs: docs/requirements.lock | $(VENV)/.locked
	$(BIN)/python -m pip install --quiet -r docs/requirements.lock
	touch $@

nightly: PACKAGES += $(if $(BROWSER),firefox-esr)
nightly: setup
	$(BIN)/python -m pytest -n 2 -m nightly
	$(BIN)/python -m tests.benchmarks stability.random_scenes
	$(BIN)/python -m tests.benchmarks stability.random_hybrids
	$(MAKE) --no-print-directory newest

newest:
	MAKE="$(MAKE)" bash tests/newest.sh

# Memory and undefined behaviour, then races between threads.
sanitize: setup
	sh tests/sanitize/run.sh address $(BIN)/python
	sh tests/sanitize/run.sh thread $(BIN)/python

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/mypy
	$(BIN)/lint-imports

wheel: setup
	rm -rf dist && mkdir -p dist/raw
	$(BIN)/pip wheel --quiet --no-deps --no-build-isolation -w dist/raw .
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/auditwheel repair -w dist dist/raw/*.whl
	sh tests/wheel.sh dist/*.whl

# The hand-written C++ programs that the benchmarks run beside ours.
peers: setup
	$(BIN)/python -m tests.benchmarks.programs

setup: packages $(VENV)/.installed

packages:
	@test -z "$(MISSING)" || { $(SUDO) apt-get update -q && \
	$(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $(MISSING); }

$(VENV)/.locked: requirements.lock | packages
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --no-compile -r requirements.lock
	touch $@

$(VENV)/.installed: $(VENV)/.locked pyproject.toml $(NATIVE)
	CMAKE_CXX_COMPILER_LAUNCHER=$$(command -v ccache) $(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

clean:
	rm -rf .venv .venv-* build dist out docs/_build docs/examples
