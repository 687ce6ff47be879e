# Everything from nothing: each target makes .venv with the pinned versions first. Needs Python >= 3.11 only.

VENV   := .venv
BIN    := $(VENV)/bin
# The optional dependencies that the tests run with. Of PyTorch, pip on Linux takes a build with gigabytes of CUDA that
# nothing here needs, unless it is told where PyTorch keeps its builds for the CPU (PIP_EXTRA_INDEX_URL).
EXTRAS ?= dev,train,plot,render,bench,docs
# The first of these that is 3.11 or newer, or yours: make test PYTHON=python3.12
PYTHON ?= $(firstword $(foreach python,python3 python3.13 python3.12 python3.11 python3.14,\
	$(shell $(python) -c 'import sys; sys.version_info >= (3, 11) and print("$(python)")' 2>/dev/null)))
PIP    := $(BIN)/python -m pip --disable-pip-version-check
# Re-installed when either changes.
PINS   := pyproject.toml constraints.txt
comma  := ,
INSTALLED := $(VENV)/.installed-$(subst $(comma),-,$(EXTRAS))
PYTEST := $(BIN)/python -m pytest -n 2 --benchmark-disable

.DEFAULT_GOAL := help
.PHONY: help demo test test-clients docs soak lint format clean

help:  ## what can be made
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST)

demo: $(VENV)/.installed-core  ## two attacks against three defenses, in a minute: no torch, no data files
	$(BIN)/trust-env demo --out $(VENV)/demo
	@echo "(trust-env is in $(BIN): source $(BIN)/activate)"

test: $(INSTALLED)  ## all tests but those of other training libraries, on two processes
	$(PYTEST) --ignore=tests/clients

# A process takes the tests of a library together: what that imports and compiles is not shared.
test-clients: $(INSTALLED)-clients  ## the examples of other training libraries, which it installs beside the rest
	$(PYTEST) --dist=loadfile tests/clients

docs: $(VENV)/.installed-docs  ## the documentation site, in docs/site; a broken link or a missing docstring fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict -f docs/mkdocs.yml

# All of one: make soak SOAKS="extremes --amount 0.1"
soak: $(INSTALLED)  ## what is too long for every run of the tests: hours; prints what was tried and what survived
	PYTHONPATH=tests $(BIN)/python -m soak.run $(SOAKS)

lint: $(INSTALLED)  ## ruff and pyright; fails on any finding
	@failed=0; \
	for tool in "ruff check ." "ruff format --check ." pyright; do \
		echo "$(BIN)/$$tool"; $(BIN)/$$tool || failed=1; \
	done; exit $$failed

format: $(INSTALLED)  ## let ruff put the code in order
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:  ## remove .venv and the caches
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# A stamp for each set of extras, so that nothing is installed twice.
$(VENV)/.installed-core: $(PINS) | $(BIN)/python
	$(PIP) install --quiet -c constraints.txt -e .
	@touch $@

$(VENV)/.installed-%: $(PINS) | $(BIN)/python
	$(PIP) install --quiet -c constraints.txt -e '.[$(subst -,$(comma),$*)]'
	@touch $@

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "trust-env needs Python 3.11 or newer: make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
