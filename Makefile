# Every target sets up what it needs: a virtual environment in .venv with viapoint and its tools.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed

.PHONY: setup demo test lint types contracts docs docs-check check bench goldens clean

setup: $(STAMP)

$(STAMP): pyproject.toml setup.py $(wildcard src/viapoint/runtime/_*.pyx src/viapoint/runtime/_*.h src/viapoint/runtime/*/_*.pyx src/viapoint/runtime/*/_*.h)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $(STAMP)

demo: setup
	$(BIN)/viapoint run examples/contour/contour.via --cell examples/contour/cell.toml --record out/contour.mcap
	$(BIN)/viapoint plot out/contour.mcap -o out/contour.png
	@echo "recording: out/contour.mcap   picture: out/contour.png"

test: setup
	$(BIN)/python -m pytest

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

contracts: setup
	$(BIN)/lint-imports

docs: setup
	$(BIN)/python docs/generate.py

docs-check: setup
	$(BIN)/python docs/generate.py --check

check: test lint types contracts docs-check

bench: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	$(BIN)/python benchmarks/run.py

goldens: setup
	$(BIN)/python -m pytest --update-goldens

clean:
	rm -rf $(VENV) build dist out
