# Targets that people and continuous integration share. `make demo` and `make test` need only Python 3.11 or newer,
# git and make; what else they need they install, or say in one line. `NO_APT=1` never asks apt for system packages.
VENV ?= .venv
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	command -v $$p >/dev/null 2>&1 && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' && echo $$p && break; done)
BIN = $(VENV)/bin
# One more than the cores (conftest.py), or so many. Each computes in one thread, since the threads of all would wait for
# each other.
WORKERS ?= auto
# Every package at one version, each file with the SHA-256 that it must have; then this checkout, from nowhere else.
PIP = -m pip --disable-pip-version-check --quiet install
LOCKED = $(PIP) --require-hashes --no-deps
CHECKOUT = $(PIP) --no-deps --no-build-isolation --no-index -e .
ONE_THREAD = OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

.PHONY: help env gl test-tools demo test test-fast nightly core golden check api docs bench bench-release psychopy bench-psychopy stress dither-mask test-quad test-vdp validate-bids lock sbom audit licences release clean

help:
	@echo "make demo       build stimuli, run 30 simulated observers, write a report"
	@echo "make test       run the tests"
	@echo "make test-fast  those of every room that take little, while you write"
	@echo "make nightly    what takes long or repeats: benchmarks small, packaging, snippets, windows x modes, mutants, stress"
	@echo "make core       the core's tests where the folder extensions/ is not there"
	@echo "make golden     what of the outputs of forty commands differs from those that were kept (GOLDEN=--write: keep them)"
	@echo "make check      floors, lint, format, types"
	@echo "make api        write docs/api.md, keys.md, options.md and log_records.md from the program"
	@echo "make docs       the pages of docs/ as a site with search, into site/"
	@echo "make bench      run time against error, peers beside; ends with what is promised and kept (benchmarks/out)"
	@echo "make bench-release    the same, and this version's figures into benchmarks/history.jsonl"
	@echo "make bench-psychopy   trial switch beside PsychoPy, in an environment of its own"
	@echo "make stress     slow sweeps to the edges, over all cores (STRESS=\"-k cable\": some; WHOLE=1: more of each)"
	@echo "make release    check, test, and make wheel, source archive, list of packages (dist/) and tag of this version"
	@echo "make sbom       which packages are installed, as CycloneDX, into sbom.json"
	@echo "make audit      known vulnerabilities of these packages, where an index can be reached"
	@echo "make lock       resolve the packages again, into requirements/ (UPGRADE=--upgrade: newest versions)"
	@echo "make licences   write docs/licences.md"
	@echo "make dither-mask     make the shipped dither mask again"
	@echo "make validate-bids DATASET=DIR   the official BIDS validator on an export"
	@echo "make test-vdp   ColorVideoVDP, in an environment of its own (.venv-vdp, with PyTorch)"
	@echo "make test-quad STEREO_GL=DIR/lib   quad-buffered for real, on a GL with stereo visuals"

env: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml requirements/dev.txt
	@test -n "$(PYTHON)" || { echo "cyclopean needs Python 3.11 or newer: install it, or name it with PYTHON=..."; exit 1; }
	@tools/system-packages venv $(PYTHON)
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "Installing the pinned packages into $(VENV) (once; a few minutes)"
	@$(BIN)/python $(LOCKED) -r requirements/dev.txt
	@$(BIN)/python $(CHECKOUT)
	@touch $@

gl: env
	@tools/system-packages gl $(BIN)/python

test-tools: gl
	@tools/system-packages test $(BIN)/python

demo: gl
	@$(BIN)/cyclopean demo

test: test-tools
	@$(ONE_THREAD) $(BIN)/python -m pytest -n $(WORKERS) --share

test-fast: env
	@$(ONE_THREAD) $(BIN)/python -m pytest -q --fast -n $(WORKERS) --share

check: env
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --namespace-packages --explicit-package-bases tests
	$(BIN)/lint-imports
	EAGER_IMPORT=1 $(BIN)/cyclopean --help > /dev/null
	$(BIN)/python tools/count_rooms.py --check
	$(BIN)/python tools/api_page.py --check

api: env
	$(BIN)/python tools/api_page.py

docs: env
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "Open site/index.html"

bench: test-tools psychopy
	@$(BIN)/python $(LOCKED) -r requirements/bench.txt \
		|| echo "note: choix and evalica cannot be installed here; what is promised beside them is not measured"
	@$(BIN)/python benchmarks/run_all.py $(BENCH)

bench-release:
	@$(MAKE) --no-print-directory bench BENCH=--release

psychopy: env
	@test -x .venv-psychopy/bin/python || $(PYTHON) -m venv .venv-psychopy
	@.venv-psychopy/bin/python -m pip install --quiet --disable-pip-version-check --no-deps \
		-r benchmarks/peers/psychopy-requirements.txt \
		|| { rm -rf .venv-psychopy; echo "note: PsychoPy cannot be installed here; its rows are left out"; }

bench-psychopy: test-tools psychopy
	$(BIN)/python benchmarks/trial_switch.py

nightly: test-tools
	@$(BIN)/python tools/stress.py --nightly

core: test-tools
	@$(ONE_THREAD) $(BIN)/python tools/core_alone.py

golden: test-tools
	@$(ONE_THREAD) $(BIN)/python tools/golden.py $(GOLDEN)

stress: test-tools
	@STRESS_WHOLE=$(WHOLE) $(BIN)/python tools/stress.py $(STRESS)

dither-mask: env
	$(BIN)/python -m devices.compensation.dither_mask

test-quad: test-tools
	@test -n "$(STEREO_GL)" || { echo "name the folder of a GL with stereo visuals: make test-quad STEREO_GL=DIR/lib"; exit 1; }
	STEREO_GL=$(STEREO_GL) $(BIN)/python -m pytest -m quad tests/quad

test-vdp:
	@test -x .venv-vdp/bin/python || $(PYTHON) -m venv .venv-vdp
	@.venv-vdp/bin/python $(LOCKED) -r requirements/dev.txt -r requirements/vdp.txt
	@.venv-vdp/bin/python $(CHECKOUT)
	$(ONE_THREAD) .venv-vdp/bin/python -m pytest -m vdp tests/vdp

validate-bids: env
	@test -n "$(DATASET)" || { echo "name the folder of a dataset: make validate-bids DATASET=DIR"; exit 1; }
	$(BIN)/bids-validator-deno --max-rows=-1 $(DATASET)

licences: env
	$(BIN)/python tools/licences.py

# In an environment of their own: what looks at the packages is not one of them.
.venv-audit/.installed: requirements/dev.txt requirements/audit.txt
	@test -x .venv-audit/bin/python || $(PYTHON) -m venv .venv-audit
	@.venv-audit/bin/python $(LOCKED) -r requirements/dev.txt -r requirements/audit.txt
	@touch $@

sbom: env .venv-audit/.installed
	@.venv-audit/bin/cyclonedx-py environment --pyproject pyproject.toml --output-reproducible \
		--output-format JSON --output-file sbom.json $(BIN)/python
	@echo "sbom.json: CycloneDX, every package in $(VENV)"

release: check test sbom
	@$(BIN)/python tools/release.py

audit: .venv-audit/.installed
	@.venv-audit/bin/python tools/audit.py .venv-audit/bin/pip-audit requirements/*.txt

lock: .venv-audit/.installed
	.venv-audit/bin/python tools/lock.py .venv-audit/bin/uv $(UPGRADE)

clean:
	rm -rf $(VENV) .venv-audit sbom.json site .cache .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
