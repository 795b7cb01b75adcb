# Everything a fresh machine needs is Python 3.10 or later with its venv module; `make PYTHON=python3.12 run` picks another one.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SCENE ?= scenes/first.txt
PICTURE ?= out/$(basename $(notdir $(SCENE))).png

.DEFAULT_GOAL := help
.PHONY: help run test test-all lint bench asm study docs clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 16

run: $(VENV)/run.stamp ## install into .venv and render a first picture into out/ (SCENE=file for another)
	@mkdir -p $(dir $(PICTURE))
	$(BIN)/clrt $(SCENE) -o $(PICTURE)

test: $(VENV)/dev.stamp ## the quick tests
	$(BIN)/python -m pytest -m "not slow" -n auto --dist loadfile

test-all: $(VENV)/dev.stamp ## all tests, the slow ones, too
	$(BIN)/python -m pytest

lint: $(VENV)/dev.stamp ## ruff and mypy
	$(BIN)/ruff check
	$(BIN)/mypy --strict

bench: $(VENV)/bench.stamp ## measure beside other tracers, into bench-results/; BENCH=--write-docs fills tables and plots of the documentation
	$(BIN)/python -m clrt.bench $(BENCH)

asm: $(VENV)/bench.stamp ## the compiled loops of the traversal, with counts of calls and spills; ASM="SCENE --precision exact" for others
	$(BIN)/python -m clrt.bench.asm $(ASM)

study: $(VENV)/study.stamp ## study six scenes, into study-results/ and docs/accuracy.md; STUDY=--quick into out/study alone
	$(BIN)/python -m clrt.study.project $(STUDY)

docs: $(VENV)/bench.stamp ## fill the tables of the documentation: the hard cases, then what `make bench` measures; many minutes
	$(BIN)/clrt verify --markdown docs/numerics.md
	$(BIN)/python -m clrt.bench --write-docs
	$(BIN)/python -m clrt.bench.effects --write-docs

clean: ## remove .venv, out/ and caches
	rm -rf $(VENV) out build dist .pytest_cache .mypy_cache .ruff_cache
	find clrt tests -name __pycache__ -type d -prune -exec rm -rf {} +

# A stamp is younger than pyproject.toml where what it stands for is installed, so that a second run starts at once.
$(VENV)/run.stamp: EXTRA := mesh
$(VENV)/dev.stamp: EXTRA := dev
$(VENV)/bench.stamp: EXTRA := bench
$(VENV)/study.stamp: EXTRA := study

$(VENV)/%.stamp: pyproject.toml $(VENV)/made.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(EXTRA)]'
	@touch $@

# Where .venv is left from another Python or half made, --clear makes it anew.
$(VENV)/made.stamp:
	@found=$$($(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2]); sys.exit(sys.version_info < (3, 10))' 2>/dev/null) || \
		{ echo "clrt needs Python 3.10 or later; $(PYTHON) is $${found:-missing}. With another one: make PYTHON=python3.12 run"; exit 1; }; \
	$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || \
		{ echo "$(PYTHON) lacks the venv module. On Debian and Ubuntu: apt install python$$found-venv"; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@
