# make reproduce and make test do all their own set-up, from a machine with only Python >= 3.11 and make.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# What pip would compile one file after the other, the libraries' own tests among them.
BYTECODE := $(BIN)/python -m compileall -q -j 0 -x '/tests?/' $(VENV)/lib

.PHONY: help reproduce test docs dist nightly faults lint format bench cuda slurm browser firefox wasm clean

help:
	@echo "make reproduce   run the whole paper: six conditions, statistics, assays, every reading of it, figures, report"
	@echo "make test        run all tests"
	@echo "make docs        build the documentation as a site, site/index.html, which needs no server"
	@echo "make nightly     run the tests that take long, which make test leaves out"
	@echo "make faults      try to break it: kills, damaged files, odd inputs, floods"
	@echo "make lint        check style and types"
	@echo "make format      put the code into its standard form"
	@echo "make bench       measure beside what one would pick instead, and fill docs/benchmarks.md"
	@echo "make cuda        add what the GPU backend needs"
	@echo "make wasm        compile the engine for browsers anew, after a change of what compiled code does"
	@echo "make slurm       as root: set up a Slurm of one node, and run a study on its jobs"
	@echo "make clean       remove the virtual environment, the site and what the tools left"

reproduce: $(VENV)/.core
	$(BIN)/baldwinlab reproduce
	$(BIN)/baldwinlab multiverse

test: $(VENV)/.dev browser
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

# Every page of docs/ and of the papers, a reference made from the code, search, laboratories that run in the page, and the
# notebooks with what their cells give. About two minutes.
docs: $(VENV)/.docs
	rm -rf $(VENV)/notebooks
	$(BIN)/python -m scripts.notebooks $(VENV)/notebooks
	$(BIN)/python -m scripts.documentation site $(VENV)/notebooks
	@echo "open site/index.html"

nightly: $(VENV)/.dev $(VENV)/.wasm $(VENV)/.jax browser firefox
	$(BIN)/python -m pytest -n auto --dist loadfile -m nightly

# What breaks things: kills, damaged files, odd inputs, floods. About ten minutes.
faults: $(VENV)/.dev
	FAULTS=all $(BIN)/python -m pytest -n logical --dist worksteal tests/faults

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "baldwinlab needs Python 3.11 or later; this is " + sys.version.split()[0] + " (set PYTHON=...)")'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.core: $(VENV)/.made requirements.txt pyproject.toml
	$(PIP) -r requirements.txt
	$(PIP) --no-build-isolation --no-deps --editable .
	$(BYTECODE)
	@touch $@

$(VENV)/.docs: $(VENV)/.core requirements-docs.txt
	$(PIP) --no-deps -r requirements-docs.txt
	@touch $@

$(VENV)/.dev: $(VENV)/.core requirements-dev.txt requirements-docs.txt
	$(PIP) --no-deps -r requirements-dev.txt
	$(BYTECODE)
	@touch $@

$(VENV)/.cuda: $(VENV)/.core requirements-cuda.txt
	$(PIP) --no-deps -r requirements-cuda.txt
	@touch $@

$(VENV)/.bench: $(VENV)/.core requirements-bench.txt
	$(PIP) -r requirements-bench.txt
	@touch $@

# The wheel and the source archive, each tried from an empty folder: see CONTRIBUTING.md.
dist: $(VENV)/.dev
	rm -rf dist
	$(BIN)/python -m hatchling build
	$(BIN)/python -m pytest -n0 tests/test_packaging.py

# Beside what one would pick instead: see docs/benchmarks.md. About four minutes.
bench: $(VENV)/.bench
	$(BIN)/python -m benchmarks.compare
	$(BIN)/python -m benchmarks.scaling
	$(BIN)/python -m benchmarks.publish

# Adds what the GPU backend needs (0.5 GB), also to compile its kernels where there is no GPU.
cuda: $(VENV)/.cuda

# The linker that makes a browser's module of a part of one's own.
$(VENV)/.wasm: $(VENV)/.core requirements-wasm.txt
	$(PIP) --no-deps -r requirements-wasm.txt
	@touch $@

# What one example of other people's optimisers needs (0.4 GB).
$(VENV)/.jax: $(VENV)/.dev requirements-jax.txt
	$(PIP) --no-deps -r requirements-jax.txt
	@touch $@

# What browsers run is compiled code, and ships: a test says when it is to be made anew. Takes a few minutes.
wasm: $(VENV)/.dev $(VENV)/.wasm
	$(BIN)/python scripts/browser_modules.py

# Installs Slurm from the distribution's packages where it is missing, and runs it on loopback only while it is tested.
slurm: $(VENV)/.dev
	scripts/check_slurm.sh $(BIN)/python

# Pages are tested in real browsers. Without one, and without the right to install it, its tests are skipped.
# $(1): packages, of which the first that there is will do; $(2): programs, of which any will do.
INSTALL := DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends
define installed
@$(foreach program,$(2),command -v $(program) >/dev/null 2>&1 ||) \
{ command -v apt-get >/dev/null && [ "$$(id -u)" = 0 ] && apt-get update -qq \
  && { $(foreach package,$(1),$(INSTALL) $(package) >/dev/null 2>&1 ||) false; }; } \
|| echo "none of $(2) is installed, nor could be: its tests will be skipped"
endef

# The headless shell draws no window around a page, for which Chromium takes as long as for the page.
browser:
	$(call installed,chromium-headless-shell chromium,chromium-headless-shell chromium chromium-browser google-chrome)

firefox:
	$(call installed,firefox-esr firefox,firefox-esr firefox)

clean:
	rm -rf $(VENV) site .mypy_cache .ruff_cache .pytest_cache .hypothesis
