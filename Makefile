PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test imports failing clean

demo: $(VENV)/installed
	$(BIN)/flowborne run ns-block-drag-max --out runs/ns-block-drag-max --replace

test: $(VENV)/installed-test
	$(BIN)/ruff check src tests tools
	$(BIN)/ruff format --check src tests tools
	$(BIN)/mypy
	$(BIN)/pytest --numprocesses auto --dist loadfile

imports: $(VENV)/installed-test
	$(BIN)/python tools/imports.py

failing: $(VENV)/installed-test
	$(BIN)/python tools/failing.py

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

$(VENV)/installed-test: pyproject.toml $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test,bench]'
	touch $@ $(VENV)/installed

clean:
	rm -rf $(VENV) runs
