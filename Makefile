# Two commands do everything: `make` (set up, then the embedded default) and `make test` (set up, then the tests).
# Each step of set-up happens once: it is a file that depends on the pins and the package's metadata.
PYTHON ?= python3
CORES ?= all
BIN := .venv/bin
comma := ,
# Package sets: for data; with training, which is most of the bytes; with tests and linters.
BASE := .venv/set-up-data
TRAINING := .venv/set-up-training
COMPILED := .venv/set-up-compiled
SETUP := .venv/set-up
TESTING := .venv/set-up-tests
BYTECODE := .venv/set-up-bytecode
SCENES := .venv/set-up-scenes
EMULATED := .venv/set-up-emulated
DOCS := .venv/set-up-docs
SNAKEMAKE := $(BIN)/snakemake --cores $(CORES)

# The small tables of a run that `make reference` stores.
TABLES := accuracy.csv stages.csv subtypes.csv comparisons.csv confusion.csv seeds.csv orderings.csv

.PHONY: all default data real measured cost accuracy-cost benchmark study test test-slow fuzz lint docs check-bytes reference help

all: default

# Write bytecode even if the caller's environment disables it: without it a training job spends 7 s on compiling torch's
# modules, a short job 1 s.
unexport PYTHONDONTWRITEBYTECODE

# Snakemake and pip keep caches in HOME, which is often not writable for the user of a service.
ifneq ($(shell test -w "$$HOME" || echo no),)
export XDG_CACHE_HOME ?= $(CURDIR)/.venv/cache
endif

# uv installs the same pinned packages faster than pip; pip is used where uv cannot (an index known only to pip).
# The caller's pip installs uv, and uv installs pip. Without a caller's pip, the one of Python takes 4 s to unpack.
PIP = { $(BIN)/python -m pip --version || $(BIN)/python -m ensurepip --default-pip; } >/dev/null 2>&1; $(BIN)/python -m pip install --quiet --disable-pip-version-check
install = $(BIN)/uv pip install --quiet --python $(BIN)/python -c envs/constraints.txt $(1) || { $(PIP) -c envs/constraints.txt $(1); }
# The packages of an extra of pyproject.toml, without this package, which must not vanish while Snakemake is running.
of_extra = $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$(1)"])')

$(BASE): pyproject.toml envs/constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: $(PYTHON) is older than Python 3.11; set PYTHON=..." >&2; exit 1; }
	@echo "set-up: making the virtual environment .venv and its installer"
	@test -x $(BIN)/python || $(PYTHON) -m venv --without-pip .venv
	@$(PYTHON) -m pip --python $(BIN)/python install --quiet --disable-pip-version-check -c envs/constraints.txt uv \
		2>/dev/null || { $(PIP) -c envs/constraints.txt uv || true; }
	@echo "set-up: installing the packages that make data"
	@$(call install,-e '.[workflow$(comma)cost]' pip)
	@rm -f $(TRAINING) $(COMPILED) $(SETUP) $(TESTING) $(DOCS) $(BYTECODE) $(SCENES) $(EMULATED)
	@touch $@

$(TRAINING): $(BASE)
	@echo "set-up: installing the packages of training, of which PyTorch is the largest"
	@$(call install,$(call of_extra,recognition))
	@touch $@

# Neither first calls nor parallel tests wait for machine code. Making one sample compiles nearly all of it.
$(COMPILED): $(BASE)
	@echo "set-up: compiling the machine code of the data stages for this processor"
	@$(BIN)/lowalt sample 'DJI Mini 2' 0 --out .venv/sample >.venv/kernels.log 2>&1 || { cat .venv/kernels.log >&2; exit 1; }
	@touch $@

# Machine code is compiled while packages are downloaded.
$(SETUP): $(BASE)
	@$(MAKE) --no-print-directory -j 2 $(TRAINING) $(COMPILED)
	@touch $@

$(TESTING): $(TRAINING)
	@echo "set-up: installing the packages of the tests, the documents and the linters"
	@$(call install,$(call of_extra,test) $(call of_extra,tensorboard) $(call of_extra,export) $(call of_extra,slurm) $(call of_extra,notebooks) $(call of_extra,methods) $(call of_extra,weights) $(call of_extra,town) $(call of_extra,tools) $(call of_extra,docs) $(call of_extra,lint))
	@touch $@

# Write the bytecode of the tests and their imports once, not in both test processes at the same time. The tests report
# files that cannot be read.
$(BYTECODE): $(TESTING)
	@echo "set-up: compiling the bytecode of the tests"
	@$(BIN)/python -m pytest --collect-only -q >.venv/bytecode.log 2>&1 || true
	@touch $@

# The tests' own machine code is compiled while their bytecode is written: that of scenes, of a town and of an echo with a
# tolerance, and that of the processors that tests emulate.
SAMPLE = lowalt sample Owl 0 --raw cells --out $@-made --overlay
SMALL = lowalt.shards.build --config config/default.yaml config/tiny.yaml tests/data/small.yaml --out $@-made
$(SCENES): $(COMPILED) $(TESTING)
	@echo "set-up: compiling the machine code of scenes"
	@for scene in config/scenes/worst.yaml config/scenes/urban.yaml studies/town/config.yaml; do \
		$(BIN)/$(SAMPLE) $$scene || true; done >.venv/scenes.log 2>&1
	@$(BIN)/lowalt sample 'NIO ET5T 2023' 0 --out $@-made --overlay tests/data/coarse.yaml >>.venv/scenes.log 2>&1 || true
	@touch $@

$(EMULATED): $(COMPILED)
	@echo "set-up: compiling the machine code of the processors that tests emulate"
	@{ PYTHONPATH=tests/support $(BIN)/python -m emulation x86-64-v2 -m $(SMALL); \
		PYTHONPATH=tests/support $(BIN)/python -m emulation avx2 -m $(SAMPLE) config/scenes/triangle.yaml; } \
		>.venv/emulated.log 2>&1 || true
	@touch $@

$(DOCS): $(BASE)
	@echo "set-up: installing the packages of the documents"
	@$(call install,$(call of_extra,docs))
	@touch $@

# Data are made while the packages of training are still being installed. The bytecode of torch takes ten seconds and is
# written once here, not in two trainings at the same time.
default: $(BASE)  ## the embedded default: data, training, evaluation, report in results/default
	@test -e $(SETUP) || { \
		$(MAKE) --no-print-directory -j 2 $(TRAINING) meanwhile && $(MAKE) --no-print-directory $(SETUP) && \
		{ $(BIN)/python -c 'import lowalt.recognition.runs, lowalt.report.__main__' 2>.venv/bytecode.log & } }
	$(SNAKEMAKE)

# From a warm cache packages install in seconds; a separate Snakemake run pays only for a download.
.PHONY: meanwhile ready
meanwhile: $(COMPILED)
	@test -e $(TRAINING) || $(SNAKEMAKE) -- prepared

data: $(BASE)  ## the default's data set only, no training
	$(SNAKEMAKE) -- data

real: $(SETUP)  ## real meshes and recordings: make real INPUTS=folder
	LOWALT_INPUTS="$$INPUTS" $(SNAKEMAKE) --configfile config/real.yaml

measured:  ## recordings held against their radars' twins: make measured INPUTS=folder of the measured sets
	$(MAKE) --no-print-directory study NAME=measured

ready: $(BYTECODE) $(SCENES) $(EMULATED)

test:  ## the test suite
	@$(MAKE) --no-print-directory -j 2 ready
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --strict-skips -m "not slow"

test-slow: $(TESTING) $(COMPILED)  ## the slow checks
	$(BIN)/python -m pytest -m slow

# One process per reader; about ten minutes.
fuzz: $(TESTING)  ## 2000 damaged files for every reader of files, 200 for one that starts a process each: results/benchmarks/fuzz.csv
	PYTHONPATH=tests/support:tests/extensions/support $(BIN)/python -m fuzzing --count 2000 --out results/benchmarks/fuzz.csv

lint:  ## ruff, snakefmt, mypy, snakemake --lint, no marks of an unfinished merge
	@$(MAKE) --no-print-directory -j 2 ready
	@$(MAKE) --no-print-directory -j 2 --output-sync=target types style

.PHONY: types style
types:
	$(BIN)/python -m mypy

style:
	! git grep -nIE '^([<]{7}|[|]{7}|[>]{7}|={7}$$)'
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

cost: $(SETUP)  ## error of the echo over its time: results/default/cost.csv and cost.svg
	$(SNAKEMAKE) -- cost

accuracy-cost: $(SETUP)  ## recognition accuracy over time, three trainings per row: results/default/accuracy_cost.csv and .svg
	$(MAKE) --no-print-directory study NAME=heights ONLY=--for-cost
	$(SNAKEMAKE) --configfile config/cost/accuracy.yaml -- accuracy_cost

BENCHMARK := lowalt-40-v1
SUBMITTED := results/$(BENCHMARK)/predictions/unseen/abc-vrp-trp-vt/0.csv
benchmark: $(SETUP)  ## the benchmark: its data compared with the kept checksums, the reference baseline trained and scored
	$(BIN)/lowalt benchmark make --cores $(CORES)
	$(SNAKEMAKE) --configfile config/$(BENCHMARK).yaml -- $(SUBMITTED)
	$(BIN)/lowalt benchmark score $(SUBMITTED) --track unseen

study:  ## a study of studies/: make study NAME=heights
	$(MAKE) --no-print-directory -C studies/$(NAME)

check-bytes: $(SETUP)  ## rebuild each data set that has a manifest in results/reference and compare every byte
	for run in $(filter-out $(if $(LOWALT_INPUTS),,real),$(basename $(notdir $(wildcard results/reference/*.sha256)))); do $(SNAKEMAKE) --forceall --configfile config/$$run.yaml -- data && \
		$(BIN)/python -m lowalt.shards.manifest check --run results/$$run --manifest results/reference/$$run.sha256 || exit 1; done

# Tables, manifests and pictures of finished runs; git shows the changes.
reference: $(SETUP)  ## keep tables, manifests and pictures of finished runs
	for run in default real; do for table in $(TABLES); do cp results/$$run/$$table results/reference/$$run-$$table 2>/dev/null || true; done; done
	for table in cost accuracy_cost; do cp results/default/$$table.csv results/reference/default-$$table.csv 2>/dev/null || true; done
	$(BIN)/python -m lowalt.report.figures.cost_plots echo --table results/reference/default-cost.csv --figure design/pictures/cost.svg
	$(BIN)/python -m lowalt.report.figures.cost_plots recognition --table results/reference/default-accuracy_cost.csv --figure design/pictures/accuracy_cost.svg
	$(BIN)/python docs/filled_tables.py docs/results.md presets=results/reference/default-
	for run in default tiny; do test ! -e results/$$run/shards || \
		$(BIN)/python -m lowalt.shards.manifest write --run results/$$run --manifest results/reference/$$run.sha256 || exit 1; done
	$(BIN)/python docs/scale_table.py --stages results/reference/default-stages.csv --costs results/reference/default-accuracy_cost.csv \
		--schema workflow/schemas/config.schema.yaml --base config/default.yaml --overlays config/workstation.yaml config/paper.yaml --out results/reference/scale.csv
	$(BIN)/python docs/tiles_picture.py results/default/shards/index.json design/pictures/tiles.png
	$(BIN)/python docs/moving_picture.py --animation design/pictures/moving.webp --still design/pictures/moving.png

# The picture of a sample is made by the command that its page shows.
docs: $(DOCS)  ## the site of documents, site/index.html; a warning or a dead link is an error
	$(BIN)/lowalt sample 'DJI Mini 2' 0 --out site/sample && cp site/sample/*-axes.png docs/pictures/sample.png
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

help:
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/:/'
