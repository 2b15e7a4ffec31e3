# Two commands do everything: `make` (set up, then the embedded default) and `make test` (set up, then the tests).
# Set-up happens once: it is a file that depends on the pins and the package's metadata.
PYTHON ?= python3
CORES ?= all
BIN := .venv/bin
SETUP := .venv/set-up
SNAKEMAKE := $(BIN)/snakemake --cores $(CORES)

.PHONY: all default data real test test-slow lint format bench clean-results help

all: default

$(SETUP): pyproject.toml envs/constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: $(PYTHON) is older than Python 3.11; set PYTHON=..." >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c envs/constraints.txt \
		-e '.[workflow,recognition,test,lint]'
	touch $@

default: $(SETUP)  ## the embedded default: data, training, evaluation, report in results/default
	$(SNAKEMAKE)

data: $(SETUP)  ## the default's data set only, no training
	$(SNAKEMAKE) -- data

real: $(SETUP)  ## real meshes and recordings: make real INPUTS=folder
	LOWALT_INPUTS=$(INPUTS) $(SNAKEMAKE) --configfile config/real.yaml

test: $(SETUP)  ## the test suite
	$(BIN)/python -m pytest -m "not slow"

test-slow: $(SETUP)  ## the slow checks
	$(BIN)/python -m pytest -m slow

lint: $(SETUP)  ## ruff, snakefmt, snakemake --lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

format: $(SETUP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

help:
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/:/'
