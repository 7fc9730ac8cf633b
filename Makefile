# make demo | make test: everything from a fresh clone; make check: what the integration run calls.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check
# every process of the tests would compile the package anew
unexport PYTHONDONTWRITEBYTECODE
# on two cores: while one waits for a camera, a kill or the app, another computes
TOGETHER = -n 3 --dist worksteal

.PHONY: help demo test check lint sample requirements clean

help:
	@echo "make demo    the sample trial, every stage, and a report to open"
	@echo "make test    the tests"
	@echo "make check   the tests with the heavy ones, ruff, mypy, import contracts"
	@echo "make sample  make the sample trial and its report anew"

$(VENV)/ready: requirements-dev.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "olivevib needs Python 3.11 or newer; name one with: make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || \
	  { echo "Python's venv module is missing; on Debian and Ubuntu: sudo apt install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) --require-hashes -r requirements-dev.txt
	$(PIP) --no-deps -e .
	@touch $@

demo: $(VENV)/ready
	$(BIN)/olivevib demo || [ $$? -eq 3 ]

test: $(VENV)/ready
	$(BIN)/pytest -m "not slow" $(TOGETHER)

lint: $(VENV)/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

$(VENV)/ready-check: $(VENV)/ready requirements-check.txt
	$(PIP) --require-hashes -r requirements-check.txt
	@touch $@

check: $(VENV)/ready  # the extras are fetched while one core lints: what lint reads does not change by them
	$(MAKE) -j2 $(VENV)/ready-check lint
	$(BIN)/pytest $(TOGETHER)

sample: $(VENV)/ready
	rm -rf trials/sample trials/sample-truth
	$(BIN)/olivevib simulate trials/sample --scenario sample
	$(BIN)/olivevib run sample || [ $$? -eq 3 ]
	$(BIN)/olivevib report sample -o reports

requirements:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --extra test pyproject.toml -o requirements-dev.txt
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header -c requirements-dev.txt pyproject.toml -o requirements.txt
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header -c requirements-dev.txt --extra test --extra check pyproject.toml -o requirements-check.txt

clean:
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache
