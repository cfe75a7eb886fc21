PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test browser imports failing exporters clean

demo: $(VENV)/installed
	$(BIN)/flowborne run ns-block-drag-max --out runs/ns-block-drag-max --replace

test: $(VENV)/installed-test
	$(BIN)/ruff check src tests tools
	$(BIN)/ruff format --check src tests tools
	$(BIN)/mypy
	$(BIN)/pytest --numprocesses auto --dist loadfile

browser: $(VENV)/installed-test
	$(BIN)/python -m pip install --quiet --editable '.[browser]'
	command -v chromium || $(BIN)/playwright install --with-deps chromium
	FLOWBORNE_SCREENSHOTS=runs/viewer $(BIN)/pytest -rs -m browser --numprocesses 0 tests/view/browser

imports: $(VENV)/installed-test
	$(BIN)/python tools/imports.py

failing: $(VENV)/installed-test
	$(BIN)/python tools/failing.py

exporters: $(VENV)/installed-test
	$(BIN)/python tools/exporters.py

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
