PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
TIER ?= minute
MACHINE ?= local

# Blender's Python: `make blender BPY=5.3.0 BLENDER_PYTHON=python3.13`
BPY ?= 5.0.1
BLENDER_PYTHON ?= python3.11
BPY_VENV := build/bpy-$(BPY)

# Folder of rigged characters: `make hero-films NAMES="whale" CHARACTERS=models`
CHARACTERS ?= .

# Every process would compile the package anew, a fifth of what it takes to start.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: baselines bench-history bench-pages blender blender-sample browser chapters clean closeness cross-checks demo dist docs exporters films fuzz gallery gltf-validator hero-films imports joss lint messages notebooks paper readme recordings same-figures size speed strangers test validation-page workflows

demo: $(VENV)/installed
	$(BIN)/flowborne run ns-block-drag-max --out runs/ns-block-drag-max --replace

lint: $(VENV)/installed-test
	$(BIN)/ruff check src validation blender tests tools docs
	$(BIN)/ruff format --check src validation blender tests tools docs
	$(BIN)/mypy

test: lint
	$(BIN)/pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

browser: $(VENV)/installed-test
	$(BIN)/python -m pip install --quiet --editable '.[browser]'
	command -v chromium || $(BIN)/playwright install --with-deps chromium
	FLOWBORNE_SCREENSHOTS=runs/viewer $(BIN)/pytest -rs -m browser --numprocesses 0 tests/view/browser

blender: $(VENV)/installed-test
	test -x $(BPY_VENV)/bin/python || $(BLENDER_PYTHON) -m venv $(BPY_VENV)
	$(BPY_VENV)/bin/python -m pip install --quiet bpy==$(BPY)
	FLOWBORNE_BPY=$(BPY_VENV)/bin/python $(BIN)/pytest -m blender --numprocesses 0 tests/blender

blender-sample: $(VENV)/installed
	test -x $(BPY_VENV)/bin/python || $(BLENDER_PYTHON) -m venv $(BPY_VENV)
	$(BPY_VENV)/bin/python -m pip install --quiet bpy==$(BPY)
	$(BPY_VENV)/bin/python tools/blender_sample.py --engine $(VENV) --out build/blender-sample

hero-films: $(VENV)/installed-test
	test -x $(BPY_VENV)/bin/python || $(BLENDER_PYTHON) -m venv $(BPY_VENV)
	$(BPY_VENV)/bin/python -m pip install --quiet bpy==$(BPY)
	nice $(BIN)/python tools/hero_films.py --blender $(BPY_VENV)/bin/python --characters "$(CHARACTERS)" --out build/hero-films $(NAMES)

dist: $(VENV)/installed-test
	$(BIN)/python -m pip install --quiet --group dist
	$(BIN)/validate-pyproject pyproject.toml validation/pyproject.toml
	$(BIN)/python tools/dist.py
	$(BIN)/twine check --strict dist/*/*
	$(BIN)/check-wheel-contents dist/*/*.whl

docs: $(VENV)/installed-test
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/docs
	@echo build/docs/index.html

gltf-validator:
	npm install --silent --no-save --prefix build gltf-validator@2.0.0-dev.3.10
	$(BIN)/pytest -rs --numprocesses 0 tests/formats/test_glb.py -k khronos

imports: $(VENV)/installed-test
	$(BIN)/python tools/imports.py

films: $(VENV)/installed-test
	$(BIN)/python tools/films.py $(NAMES)

chapters: $(VENV)/installed-test
	$(BIN)/python tools/chapters.py

gallery: $(VENV)/installed-test
	$(BIN)/python tools/gallery.py $(NAMES)

joss: $(VENV)/installed-test
	$(BIN)/python tools/joss.py

notebooks: $(VENV)/installed-test
	$(BIN)/python tools/notebooks.py

paper: $(VENV)/installed-test
	$(BIN)/python tools/paper.py

readme: $(VENV)/installed-test
	$(BIN)/python tools/readme.py

recordings: $(VENV)/installed-test
	$(BIN)/python tools/recordings.py $(NAMES)

validation-page: $(VENV)/installed-test
	$(BIN)/python tools/validation_page.py

speed: $(VENV)/installed-test
	NUMBA_NUM_THREADS=1 $(BIN)/python tools/accuracy.py

same-figures: $(VENV)/installed-test
	rm -rf build/report
	-$(BIN)/flowborne validate --tier $(TIER) --report build/report
	$(BIN)/python tools/same_figures.py build/report $(TIER)

exporters: $(VENV)/installed-test
	$(BIN)/python tools/exporters.py

fuzz: $(VENV)/installed-test
	$(BIN)/python tools/fuzz.py --seed "$(SEED)"

strangers: $(VENV)/installed-test
	$(BIN)/python tools/strangers.py

size: $(VENV)/installed-test
	$(BIN)/python tools/size.py

messages: $(VENV)/installed-test
	$(BIN)/python tools/messages.py

closeness: $(VENV)/installed-test
	$(BIN)/python tools/closeness.py

cross-checks: $(VENV)/installed-test
	test -x build/ptera/bin/python || $(PYTHON) -m venv build/ptera
	build/ptera/bin/python -m pip install --quiet pterasoftware
	NUMBA_NUM_THREADS=1 $(BIN)/python tools/flapping.py build/ptera/bin/python
	NUMBA_NUM_THREADS=1 $(BIN)/python tools/heaving.py
	NUMBA_NUM_THREADS=1 $(BIN)/python tools/waterlily.py

baselines: $(VENV)/installed-test
	$(BIN)/python tools/baselines.py $(NAMES)
	$(BIN)/python tools/learning_page.py

workflows: $(VENV)/made
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --group workflows
	$(BIN)/actionlint
	$(BIN)/zizmor --offline .github

bench-history: $(VENV)/installed-test
	$(BIN)/python -m pip install --quiet --group bench
	$(BIN)/asv machine --yes --machine $(MACHINE) --config validation/asv.conf.json
	$(BIN)/asv run --config validation/asv.conf.json --machine $(MACHINE) --environment existing:same --set-commit-hash $$(git rev-parse HEAD)

bench-pages: $(VENV)/installed-test
	$(BIN)/python -m pip install --quiet --group bench
	$(BIN)/asv publish --config validation/asv.conf.json --html-dir build/docs/benchmarks

$(VENV)/made:
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/installed: pyproject.toml validation/pyproject.toml $(VENV)/made
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[film]' --editable ./validation
	touch $@

$(VENV)/installed-test: pyproject.toml validation/pyproject.toml $(VENV)/made
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test]' --editable './validation[bench]'
	touch $@ $(VENV)/installed

clean:
	rm -rf $(VENV) build dist runs
