PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PACKAGES := package geometry data diagnosis ekf smoother compare reports
OUT ?= out/simulated

# What `$(call installed,...)` is given goes to uv, which takes 20 seconds where pip takes 100. Where uv cannot (a mirror
# that only pip is configured for), pip does it, and says so. Both compile bytecode: without it a start takes three times
# as long where PYTHONDONTWRITEBYTECODE is set, as in many containers, and tests start Python often.
UV := UV_SYSTEM_CERTS=1 $(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --reinstall-package fgbaseline
installed = { $(UV) $(1) || { echo "uv could not install; pip does" >&2; $(BIN)/pip install --quiet $(1); }; }

QUICK_CHECK :=

.PHONY: run test test-all coverage mutants quick bench docs figures fuzz lint types arrows install schema wheel clean

run: install
	$(BIN)/fgbaseline run --out $(OUT) --force

# Files are shared out whole: their tests share what is expensive.
test: install lint types arrows
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not full"
	@echo "Left out: tests that take minutes to hours (marked full). make test-all runs them too."

# Everything, in hours: after `make test` every command of README and docs as it is printed, figures drawn, on the real
# recordings where they are at hand, and every mutation of a recording or trajectory.
test-all: test
	$(BIN)/pytest -m full

# Which lines and branches the tests run, in all processes: fails below 92 % of both together (pyproject.toml), and below
# 92 % of the branches. Twice as long as the tests alone. What killed commands left half-written is passed over.
coverage: install
	rm -rf out/coverage
	$(BIN)/coverage run -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not full"
	$(BIN)/coverage combine --quiet
	rm -f out/coverage/data.*
	$(BIN)/coverage json --quiet --fail-under 0
	$(BIN)/python -m benchmarks.branch_coverage --at-least 92
	$(BIN)/coverage report

# Small errors put into compare and ekf, some in each module: do the tests notice? docs/mutants.md is written anew.
MUTANTS ?= 5
MUTANTS_SEED ?= 3
mutants: install
	$(call installed,--group mutants)
	nice -n 10 $(BIN)/python -m benchmarks.mutants --per-module $(MUTANTS) --seed $(MUTANTS_SEED)

# Are our own estimators as good as they were? `make test` asks it of fewer seeds (tests/reports/test_check_ourselves.py), without
# the report. QUICK_CHECK=--update-baseline says that they are meant to differ.
quick: install
	$(BIN)/fgbaseline bench suites/quick.toml --out out/bench/quick
	$(BIN)/fgbaseline check out/bench/quick --limits suites/quick-limits.toml --baseline suites/quick-baseline.json $(QUICK_CHECK)

# The site, to be read from its folder: out/docs/index.html. A warning is an error. The variable turns off an advertisement.
docs: install
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "The site is in out/docs/index.html"

# The pictures that are in docs/images, by the commands that stand beside them. Five minutes, and a Chromium.
figures: run
	$(BIN)/python benchmarks/report_image.py $(OUT) docs/images/report.png
	$(BIN)/python -m benchmarks.rendered_room out/room
	$(BIN)/fgbaseline run out/room --out out/room_run --force
	$(BIN)/python benchmarks/report_image.py out/room_run docs/images/one-frame.png --section one-frame
	$(BIN)/python benchmarks/consistency.py --seeds 50 --figure docs/images/consistency.png

# Mutated files for every reader, guided by coverage; FUZZ_SECONDS for each of them.
FUZZ_SECONDS ?= 60
fuzz: install
	$(call installed,--group fuzz)
	$(BIN)/python -m benchmarks.fuzz --seconds $(FUZZ_SECONDS)

# Time and memory, side by side in one run: docs/performance.md is written anew. It takes the better part of an hour on an
# idle machine; BENCH_FLAGS=--quick tries it in minutes, on small sizes, and writes nothing.
RECORDINGS ?= $(or $(FGBASELINE_RECORDINGS),../shared/data)
BENCH_RUNS ?= 3
BENCH_FLAGS :=
bench: install
	$(BIN)/python -m benchmarks.performance --recordings $(RECORDINGS) --runs $(BENCH_RUNS) \
	  --figure docs/images/growth.png $(BENCH_FLAGS)
	$(BIN)/python -m benchmarks.latency $(if $(BENCH_FLAGS),--runs 1,--write) \
	  $(addprefix --recording ,$(wildcard $(RECORDINGS)/03.npz))

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: install
	$(BIN)/mypy -p fgbaseline -p benchmarks

arrows: install
	$(BIN)/lint-imports

# A strict editable install maps single files, so a new file needs a new install: the list of files is the stamp.
FILES := $(sort $(shell find $(PACKAGES) -type f -not -name '*.pyc'))

install: $(VENV)/tools.stamp
	@echo "$(FILES)" | cmp -s - $(VENV)/files.stamp || { \
	  rm -rf build/__editable__* && \
	  $(call installed,--no-build-isolation --no-deps --config-settings editable_mode=strict -e .) && \
	  echo "$(FILES)" > $(VENV)/files.stamp; }
	@$(BIN)/python -m compileall -q build

$(VENV)/tools.stamp: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --upgrade 'pip>=25.1' 'setuptools>=77' 'uv>=0.13'
	rm -rf build/__editable__*
	$(call installed,--no-build-isolation --config-settings editable_mode=strict -e . --group dev)
	@rm -f $(VENV)/files.stamp
	touch $@

schema: install
	$(BIN)/python -m fgbaseline.reports.results.run > docs/summary.schema.json
	$(BIN)/python -m fgbaseline.reports.results.comparison > docs/comparison.schema.json

wheel: install
	$(BIN)/python -m build

clean:
	rm -rf $(VENV) build dist *.egg-info
