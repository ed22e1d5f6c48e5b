# Every target installs what it needs into .venv. A machine needs only Python >= 3.11 and make.

# The Python of the distribution, if it is supported, because most users have it.
PYTHON ?= $(shell /usr/bin/python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null \
  && echo /usr/bin/python3 || echo python3)
# Processes load the bytecode of the package and of tests instead of compiling the sources again.
unexport PYTHONDONTWRITEBYTECODE
VENV ?= .venv
BIN := $(VENV)/bin
DENO := DENO_DIR=$(VENV)/deno DENO_NO_UPDATE_CHECK=1 $(BIN)/deno
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --no-deps
# $(call check,PYTHON): check that the installed versions are compatible. Versions of an earlier lock may not be.
check = $(1) -m pip check --disable-pip-version-check || { echo "run 'make clean', then the same command again"; exit 1; }
# $(call install,FILE): install the locked versions of a file.
install = $(PIP) --require-hashes -r $(1) && { $(call check,$(BIN)/python); }
# pip compiles files one by one, with the tests of the libraries. This command uses all cores.
BYTECODE := $(BIN)/python -m compileall -q -j 0 -x '/tests?/' $(VENV)/lib

# System packages can be installed on Debian and its derivatives, as root.
APT := command -v apt-get >/dev/null && [ "$$(id -u)" = 0 ] && apt-get update -qq
INSTALL := DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends

.PHONY: help reproduce test docs dist nightly slow faults lint format lock oldest newest bench bench-scale cuda slurm \
  browser firefox wasm bitcode clean

help:
	@echo "make reproduce   reproduce the paper: six conditions, assays, all variants, statistics, figures, report"
	@echo "make test        run all tests"
	@echo "make docs        build the documentation as a site (site/index.html) that needs no server"
	@echo "make nightly     run oldest, newest, slow and faults, and print a table of times and results"
	@echo "make slow        run the slow tests that make test skips"
	@echo "make faults      run tests with killed processes, damaged files, odd inputs and floods of requests"
	@echo "make lint        check style, imports, types and JavaScript"
	@echo "make format      format the code"
	@echo "make bench       compare the speed with alternatives, and measure larger worlds and more cores"
	@echo "make bench-scale  measure the cost of many runs, agents and threads, and compare it with an earlier commit"
	@echo "make cuda        install the requirements of the GPU backend"
	@echo "make wasm        compile the engine for browsers again, after a change of compiled code"
	@echo "make slurm       as root: set up Slurm with one node, and run a study on it"
	@echo "make bitcode     compile the paper's entry points for the package again, after a change of their sources"
	@echo "make lock        resolve the locked files from pyproject.toml (UPGRADE=--upgrade: new versions)"
	@echo "make oldest      run a part of the tests with the oldest versions that pyproject.toml allows"
	@echo "make newest      run a part of the tests with the newest versions"
	@echo "make clean       remove the virtual environment, the site and caches"

reproduce: $(VENV)/.core
	$(BIN)/baldwinlab reproduce
	$(BIN)/baldwinlab multiverse

test: $(VENV)/.dev browser
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

# All pages of docs/ and of the papers, a reference from the code, search, live laboratories, and the notebooks with
# the results of their cells. About two minutes.
docs: $(VENV)/.dev
	rm -rf site $(VENV)/doctrees
	$(BIN)/python -m scripts.notebooks site/executed
	$(BIN)/python -m sphinx -W --keep-going -q -d $(VENV)/doctrees -c docs . site
	cp site/README.html site/index.html
	@echo "open site/index.html"

# At most 90 minutes on two cores.
nightly:
	@scripts/nightly.sh oldest newest slow faults

# Property tests have random examples here, and the same examples each time in `make test`.
SEED := $(shell date +%s)
slow: $(VENV)/.dev $(VENV)/.nightly browser firefox
	$(BIN)/python -m pytest -n auto --dist loadfile -m "nightly or hypothesis" --hypothesis-seed=$(SEED) \
	  || { echo "make slow SEED=$(SEED) repeats the examples of the property tests"; exit 1; }

# About ten minutes.
faults: $(VENV)/.dev
	FAULTS=all STRANGERS_SEED=$(SEED) $(BIN)/python -m pytest -n logical --dist worksteal tests/faults \
	  || { echo "make faults SEED=$(SEED) repeats the examples of the grammars"; exit 1; }

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache
	$(DENO) fmt --check --quiet
	$(DENO) lint --quiet baldwinlab/lab/static
	$(DENO) check --quiet baldwinlab/lab/static
	$(BIN)/mypy

format: $(VENV)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(DENO) fmt --quiet

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "baldwinlab needs Python 3.11 or later; this is " \
	  + sys.version.split()[0] + " (set PYTHON=...)")'
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || { $(APT) && $(INSTALL) python3-venv; } \
	  || { echo "$(PYTHON) has no module venv: install your distribution's package, such as python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.core: $(VENV)/.made requirements.txt pyproject.toml
	$(PIP) --require-hashes -r requirements.txt
	$(PIP) --no-build-isolation --editable .
	@$(call check,$(BIN)/python)
	$(BYTECODE)
	@touch $@

$(VENV)/.dev: $(VENV)/.core requirements-dev.txt
	$(call install,requirements-dev.txt)
	$(BYTECODE)
	@touch $@

$(VENV)/.cuda: $(VENV)/.core requirements-cuda.txt
	$(call install,requirements-cuda.txt)
	@touch $@

# Validators of exports and clients of environments have a separate environment: see pyproject.toml. On Linux, the
# default build of PyTorch has gigabytes of libraries for GPUs. Its build for CPUs is in an index of PyTorch, so it is
# installed if pip knows that index (PIP_EXTRA_INDEX_URL), or else the default build.
TORCH := 2.13.0
$(VENV)/.nightly: $(VENV)/.made requirements-nightly.txt
	@command -v c++ >/dev/null || { $(APT) && $(INSTALL) g++ python3-dev; }
	$(PYTHON) -m venv --clear $(VENV)/nightly
	$(VENV)/nightly/bin/python -m pip install --quiet --require-hashes --no-deps -r requirements-nightly.txt
	$(VENV)/nightly/bin/python -m pip install --quiet torch==$(TORCH)+cpu \
	  || $(VENV)/nightly/bin/python -m pip install --quiet torch==$(TORCH)
	@$(call check,$(VENV)/nightly/bin/python)
	@touch $@

# The extras of pyproject.toml are the only source. The locked files contain hashes and no addresses, and are valid
# for every supported Python.
COMPILE := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
  --custom-compile-command "make lock" $(UPGRADE)
extras = $(foreach extra,$(1),--extra $(extra))
USERS := cluster exchange lab notebook rl s3 video
comma := ,

lock: $(VENV)/.dev
	echo "torch ; python_version < '3'" | $(COMPILE) --overrides /dev/stdin pyproject.toml --extra rl --group nightly \
	  --output-file requirements-nightly.txt
	$(COMPILE) pyproject.toml $(call extras,$(USERS) bench build dev docs test wasm) --output-file requirements-dev.txt
	$(COMPILE) pyproject.toml $(call extras,build lab video) --constraints requirements-dev.txt --output-file requirements.txt
	$(COMPILE) pyproject.toml --extra cuda --constraints requirements-dev.txt --output-file requirements-cuda.txt

# Both ends of the bounds of pyproject.toml, each in a separate environment, on tests that take a few minutes.
SLICE := tests/engine tests/experiment tests/analysis/statistics tests/analysis/figures/test_panels.py \
  tests/evolution tests/api/export \
  tests/core/test_console.py tests/core/test_netcdf.py tests/core/test_files.py tests/cli/test_cli.py
oldest: RESOLUTION := lowest-direct
newest: RESOLUTION := highest
oldest newest: EXTRAS := $(subst $() ,$(comma),$(USERS))
oldest newest: $(VENV)/.dev
	$(BIN)/uv venv --quiet --clear --python $(PYTHON) $(VENV)/$@
	$(BIN)/uv pip install --quiet --python $(VENV)/$@ --resolution $(RESOLUTION) --editable ".[$(EXTRAS)]"
	$(BIN)/uv pip install --quiet --python $(VENV)/$@ --editable ".[$(EXTRAS),test]"
	$(BIN)/uv pip check --python $(VENV)/$@
	$(VENV)/$@/bin/python -m pytest -n auto --dist loadfile $(SLICE)

# The wheel and the source archive, each tested in an empty folder: see CONTRIBUTING.md.
dist: $(VENV)/.dev
	rm -rf dist
	$(BIN)/python -m hatchling build
	$(BIN)/python -m pytest -n0 tests/test_packaging.py

# About five minutes: see benchmarks/README.md.
bench: $(VENV)/.dev
	$(BIN)/python -m benchmarks.compare
	$(BIN)/python -m benchmarks.world_size
	$(BIN)/python -m benchmarks.host
	$(BIN)/python -m benchmarks.scaling

# The cost of many runs, agents and threads, compared with an earlier commit.
bench-scale: $(VENV)/.dev
	$(BIN)/python -m benchmarks.scale

# 0.5 GB. Kernels can be compiled without a GPU.
cuda: $(VENV)/.cuda

# The package contains the engine as WebAssembly. A test fails if it is out of date. A few minutes.
wasm: $(VENV)/.dev
	$(BIN)/python scripts/browser_modules.py

# The package contains bitcode of the paper's entry points. A test fails if it is out of date. About a minute.
bitcode: $(VENV)/.dev
	$(BIN)/python -m scripts.entry_points

# Slurm is installed from the packages of the distribution if it is missing. It runs on loopback, only during the test.
slurm: $(VENV)/.dev
	scripts/check_slurm.sh $(BIN)/python

# Pages are tested in real browsers. Their tests are skipped if no browser is installed and none can be installed.
# $(1): packages, of which the first available one is installed; $(2): programs, of which one is enough.
define installed
@$(foreach program,$(2),command -v $(program) >/dev/null 2>&1 ||) \
{ $(APT) && { $(foreach package,$(1),$(INSTALL) $(package) >/dev/null 2>&1 ||) false; }; } \
|| echo "none of $(2) is installed or can be installed: the tests in this browser will be skipped"
endef

# The headless shell is faster than Chromium, which also draws a window around a page.
browser:
	$(call installed,chromium-headless-shell chromium,chromium-headless-shell chromium chromium-browser google-chrome)

firefox:
	$(call installed,firefox-esr firefox,firefox-esr firefox)

clean:
	rm -rf $(VENV) site .mypy_cache .ruff_cache .pytest_cache .hypothesis
