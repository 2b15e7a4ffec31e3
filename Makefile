# Two commands do everything: `make` (set up, then the embedded default) and `make test` (set up, then the tests).
# Each step of set-up happens once: it is a file that depends on the pins and the package's metadata.
PYTHON ?= python3
CORES ?= all
BIN := .venv/bin
comma := ,
# Packages that make data; those of training as well, which are most of the bytes; those of tests and linters as well.
BASE := .venv/set-up-data
SETUP := .venv/set-up
TESTING := .venv/set-up-tests
KERNELS := .venv/set-up-kernels
BYTECODE := .venv/set-up-bytecode
SNAKEMAKE := $(BIN)/snakemake --cores $(CORES)

# The oldest and the newest NumPy that pyproject.toml allows.
NUMPYS := 2.0.0 2.4.6
OLDEST_SNAKEMAKE := 9.23.0
REFERENCE := accuracy.csv stages.csv subtypes.csv comparisons.csv confusion.csv seeds.csv orderings.csv

DOCS := .venv/set-up-docs

.PHONY: all audit docs docs-pages notebooks default data real measured test test-slow fuzz lint format bench bench-workflow bench-make bench-walk long-run status cost gallery hard-cases accuracy-cost study effects-cost estimate space campaign reference reference-accuracy pictures pins check-bytes check-numpy check-snakemake check-arm manifest help

all: default

# Bytecode is kept even where the caller's environment says otherwise: a job of training spends 7 s on compiling torch's
# modules without it, a short job 1 s.
unexport PYTHONDONTWRITEBYTECODE

# Snakemake and pip keep caches in HOME; the user of a service often has none that can be written.
ifneq ($(shell test -w "$$HOME" || echo no),)
export XDG_CACHE_HOME ?= $(CURDIR)/.venv/cache
endif

# uv installs the same pinned packages in less time than pip; pip does it where uv cannot (an index that only pip knows).
# The caller's pip brings uv, and uv brings pip; where the caller has none, the one that Python brings takes 4 s to unpack.
PIP = { $(BIN)/python -m pip --version || $(BIN)/python -m ensurepip --default-pip; } >/dev/null 2>&1; $(BIN)/python -m pip install --quiet --disable-pip-version-check
install = $(BIN)/uv pip install --quiet --python $(BIN)/python -c envs/constraints.txt $(1) || { $(PIP) -c envs/constraints.txt $(1); }
# The packages that an extra of pyproject.toml names, without this package: a Snakemake that runs would miss it for a moment.
of_extra = $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$(1)"])')

$(BASE): pyproject.toml envs/constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: $(PYTHON) is older than Python 3.11; set PYTHON=..." >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv --without-pip .venv
	$(PYTHON) -m pip --python $(BIN)/python install --quiet --disable-pip-version-check -c envs/constraints.txt uv \
		2>/dev/null || { $(PIP) -c envs/constraints.txt uv || true; }
	$(call install,-e '.[workflow$(comma)cost]' pip)
	rm -f $(SETUP) $(TESTING) $(DOCS) $(KERNELS) $(BYTECODE) .venv/set-up-methods .venv/set-up-audit
	touch $@

$(SETUP): $(BASE)
	$(call install,$(call of_extra,recognition))
	touch $@

$(TESTING): $(SETUP)
	$(call install,$(call of_extra,test) $(call of_extra,tensorboard) $(call of_extra,export) $(call of_extra,slurm) $(call of_extra,notebooks) $(call of_extra,methods) $(call of_extra,tools) $(call of_extra,docs) $(call of_extra,lint))
	touch $@

# Machine code of the data stages: compiled once, while packages come, and not by many tests at the same time.
$(KERNELS): $(BASE)
	$(BIN)/python -m lowalt.workflow.kernels 2>.venv/kernels.log || { cat .venv/kernels.log >&2; exit 1; }
	touch $@

# Bytecode of the tests and of what they import: written once, not by both processes of the tests at the same time. Where a
# file cannot be read, the tests say so.
$(BYTECODE): $(TESTING)
	$(BIN)/python -m pytest --collect-only -q >.venv/bytecode.log 2>&1 || true
	touch $@

$(DOCS): $(BASE)
	$(call install,$(call of_extra,docs))
	touch $@

# Where the packages of training are not there yet, they come while the data are made; so does the machine code, for
# which jobs wait that need it. Bytecode of torch takes ten seconds: written once here, not by two trainings at a time.
default: $(BASE)  ## the embedded default: data, training, evaluation, report in results/default
	@test -e $(SETUP) || { $(BIN)/python -m lowalt.workflow.kernels 2>.venv/kernels.log & \
		$(MAKE) --no-print-directory -j 2 $(SETUP) meanwhile && \
		{ $(BIN)/python -c 'import lowalt.recognition.runs, lowalt.report.__main__' 2>.venv/bytecode.log & } }
	$(SNAKEMAKE)

# From a warm cache the packages are there in seconds; only a download is worth a Snakemake of its own.
.PHONY: meanwhile ready
meanwhile: $(BASE)
	@for second in 1 2 3 4 5 6 7 8; do test -e $(SETUP) && exit; sleep 1; done; $(SNAKEMAKE) -- prepared

data: $(BASE)  ## the default's data set only, no training
	$(SNAKEMAKE) -- data

real: $(SETUP)  ## real meshes and recordings: make real INPUTS=folder
	LOWALT_INPUTS="$$INPUTS" $(SNAKEMAKE) --configfile config/real.yaml

# Twice gives equal bytes. Of the recordings only those of vehicles have a licence, so only their picture is kept in git.
measured: $(SETUP)  ## recordings held against their radars' twins: make measured INPUTS=folder of the measured sets
	for step in pairs compare; do $(BIN)/python -m lowalt.recordings $$step --inputs "$$INPUTS" --out results/measured || exit 1; done
	$(BIN)/python -m lowalt.recordings recognise --inputs "$$INPUTS" --out results/measured --models results/measured/models
	$(BIN)/python -m lowalt.recordings ablate --inputs "$$INPUTS" --out results/measured --models results/measured/models/ablation
	$(BIN)/python -m lowalt.report.measured --pairs results/measured --tables results/measured --page results/measured/report.html
	cp results/measured/measured-*.csv results/reference/
	for pair in measured-vehicle.png:results/reference/ measured-short.png:design/pictures/measured.png; do \
	  if [ -f results/measured/$${pair%%:*} ]; then cp results/measured/$${pair%%:*} $${pair##*:}; fi; done

ready: $(BYTECODE) $(KERNELS)

test:  ## the test suite
	@$(MAKE) --no-print-directory -j 2 ready
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --strict-skips -m "not slow"

test-slow: $(TESTING)  ## the slow checks
	$(BIN)/python -m pytest -m slow

# One process a reader; some ten minutes.
fuzz: $(TESTING)  ## 2000 damaged files for every reader of files, 200 for one that starts a process each: results/benchmarks/fuzz.csv
	PYTHONPATH=tests/support $(BIN)/python -m fuzzing --count 2000 --out results/benchmarks/fuzz.csv

lint:  ## ruff, snakefmt, mypy, snakemake --lint
	@$(MAKE) --no-print-directory -j 2 ready
	@$(MAKE) --no-print-directory -j 2 --output-sync=target types style

.PHONY: types style
types:
	$(BIN)/python -m mypy

style:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/snakemake --lint

format: $(TESTING)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

# Benchmarks need a finished `make data`, a quiet machine and the extra `bench` (zlib-ng, a peer of the PNG writer).
.venv/bench: $(SETUP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c envs/constraints.txt -e '.[bench]'
	touch $@

bench: .venv/bench  ## all benchmarks, into results/benchmarks
	$(SNAKEMAKE) -- data
	$(BIN)/python benchmarks/echo.py --clouds results/default/clouds/*.npz
	$(BIN)/python benchmarks/rounding.py --out results/benchmarks/rounding.csv
	$(BIN)/python benchmarks/images.py --run results/default --out results/benchmarks/images.csv
	$(BIN)/python benchmarks/loader.py --run results/default --out results/benchmarks/loader.csv
	$(BIN)/python benchmarks/scenes.py --run results/default --out results/benchmarks/scenes.csv
	$(BIN)/python benchmarks/interval_coverage.py --out results/benchmarks/interval_coverage.csv

bench-workflow: $(SETUP)  ## time of Snakemake itself for 1 000 and for 10 000 short jobs: results/benchmarks/scheduling.csv
	$(BIN)/python benchmarks/workflow.py --out results/benchmarks/scheduling.csv

# LABEL names the rows, for example a revision; COLD=--cold fetches all packages from their index.
LABEL ?= this revision
bench-make: $(SETUP)  ## wall and processor time of `make` from an empty clone, part by part: results/benchmarks/workflow.csv
	$(BIN)/python benchmarks/from_clone.py --out results/benchmarks/workflow.csv --label '$(LABEL)' $(COLD)

bench-walk: $(SETUP)  ## a new user's walk through the documents, each step timed, from clone to a network of one's own in the report: results/benchmarks/walk.csv
	$(BIN)/python benchmarks/walk.py --out results/benchmarks/walk.csv --label '$(LABEL)'

# The default's samples twenty times over: make long-run MODELS=2000
long-run: $(BASE)  ## 200 000 samples end to end as signals, verified, with time and peak memory by stage: results/benchmarks/long_run.csv
	$(BIN)/python benchmarks/long_run.py $(if $(MODELS),--models $(MODELS)) --out results/benchmarks/long_run.csv

status: $(SETUP)  ## the state of a run in another terminal
	@$(BIN)/python -m lowalt.workflow.status

cost: $(SETUP)  ## time of the echo over its accuracy, up to 1600 points: results/cost/cost.csv and cost.png
	$(SNAKEMAKE) --configfile config/cost/echo.yaml -- cost

gallery: $(BASE)  ## a page that links all runs and compares any two: results/index.html
	$(BIN)/lowalt report --gallery

hard-cases: $(BASE)  ## inputs on which a naive formula fails, its error, ours and the bound: results/default/hard_cases.csv
	$(BIN)/python -m lowalt.measure.hard_cases --out results/default/hard_cases.csv

accuracy-cost: $(SETUP)  ## recognition accuracy over time, three trainings a row: results/default/accuracy_cost.csv and .png
	for order in 1 2 3; do $(SNAKEMAKE) --configfile config/cost/fidelity.yaml config/cost/fidelity-1e-$$order.yaml -- models || exit 1; done
	$(SNAKEMAKE) --configfile config/cost/fidelity.yaml -- results/fidelity-exact/transfer.csv
	$(SNAKEMAKE) --configfile config/cost/accuracy.yaml -- accuracy_cost

effects-cost: $(SETUP)  ## time and influence of each effect, alone and together: results/default/effects.csv and .png
	$(SNAKEMAKE) -- effects_cost

study:  ## a study of studies/: make study NAME=rotors
	$(MAKE) --no-print-directory -C studies/$(NAME)

# The classical methods' packages, which nothing else needs.
METHODS := .venv/set-up-methods
$(METHODS): $(SETUP)
	$(call install,$(call of_extra,methods))
	touch $@

# Its own stamp: nothing else needs pip-audit. Without the internet the table is all there is, and the status says so.
.venv/set-up-audit: $(BASE)
	$(call install,$(call of_extra,audit))
	touch $@

audit: .venv/set-up-audit  ## known vulnerabilities of the pinned packages; without internet their versions and dates, .venv/pins.csv
	$(BIN)/python .ci/audit_pins.py --pins envs/constraints.txt --out .venv/pins.csv

check-bytes: $(SETUP)  ## rebuild each data set that has a manifest in results/reference and compare every byte
	for run in $(filter-out $(if $(LOWALT_INPUTS),,real),$(basename $(notdir $(wildcard results/reference/*.sha256)))); do $(SNAKEMAKE) --forceall --configfile config/$$run.yaml -- data && \
		$(BIN)/python -m lowalt.shards.manifest check --run results/$$run --manifest results/reference/$$run.sha256 || exit 1; done

# Two environments of their own, so that this one keeps its NumPy.
check-numpy: $(SETUP)  ## the tiny data set with the oldest and the newest NumPy that pyproject.toml allows
	for version in $(NUMPYS); do .ci/numpy.sh $(PYTHON) $$version || exit 1; done

# An environment of its own too; the newest Snakemake is the pinned one, which the tests run.
check-snakemake:  ## the tiny data set with the oldest Snakemake that pyproject.toml allows
	.ci/snakemake.sh $(PYTHON) $(OLDEST_SNAKEMAKE)

# Debian's packages of another architecture; everything goes into ARM, nothing is installed.
ARM ?= .venv/arm
check-arm: $(SETUP)  ## the tiny data set on an emulated 64-bit ARM processor: Debian on x86-64, ten minutes
	.ci/arm.sh $(ARM)

manifest:  ## keep the checksums of the finished default and tiny runs
	for run in default tiny; do $(BIN)/python -m lowalt.shards.manifest write --run results/$$run --manifest results/reference/$$run.sha256 || exit 1; done

estimate: $(SETUP)  ## time and disk of the larger configurations, scaled from the reference run's measured stages
	$(BIN)/python -m lowalt.measure.scale --stages results/reference/default-stages.csv --costs results/reference/default-accuracy_cost.csv \
		--schema workflow/schemas/config.schema.yaml --base config/default.yaml --overlays config/workstation.yaml config/paper.yaml --out results/reference/scale.csv

# Full disks need root; add MEMORY_GROUP=/sys/fs/cgroup for kills by the kernel's out-of-memory killer.
KILLS ?= 30
DISKS ?= 5
CONFIGFILE ?= config/tiny.yaml
campaign: $(SETUP)  ## kill runs and fill disks at random, resume, compare bytes: make campaign KILLS=100 CONFIGFILE=config/default.yaml
	$(BIN)/python -m lowalt.workflow.campaign --configfile $(CONFIGFILE) --kills $(KILLS) --disks $(DISKS) \
		$(if $(MEMORY_GROUP),--memory-group $(MEMORY_GROUP)) --out results/benchmarks/campaign.csv

space: $(SETUP)  ## disk and memory of jobs, measured: make space RUNS='results/tiny results/default' (finished, small to large)
	$(BIN)/python -m lowalt.workflow.space_measured --runs $(RUNS) \
		--stages results/reference/default-stages.csv --config config/default.yaml --out results/reference/space.csv

reference-accuracy: $(SETUP)  ## keep the table of a finished `make accuracy-cost` and write it into the documents
	for end in csv png; do cp results/default/accuracy_cost.$$end results/reference/default-accuracy_cost.$$end; done
	$(BIN)/python -m lowalt.report.documents design/recognition.md cost=results/reference/default-

reference:  ## keep the small tables of the finished default and real runs
	for run in default real; do for table in $(REFERENCE); do cp results/$$run/$$table results/reference/$$run-$$table; done; done

pictures: $(SETUP)  ## the README's picture, from the finished default run
	$(BIN)/python -m lowalt.report.figures.cover results/default/shards/index.json design/pictures/tiles.png

pins: $(TESTING)  ## write the installed versions as the pins
	( head -2 envs/constraints.txt; $(BIN)/python -m pip freeze --all --exclude-editable ) > .venv/pins && mv .venv/pins envs/constraints.txt

docs-pages: $(BASE)  ## write the page of the configuration's keys from its schema, and the picture of a sample
	$(BIN)/python -m lowalt.common.schema_page workflow/schemas/config.schema.yaml docs/reference/configuration.md
	$(BIN)/lowalt sample 'DJI Mini 2' 0 --out site/sample && cp site/sample/*-axes.png docs/pictures/sample.png

docs: $(DOCS)  ## the site of documents, site/index.html; a warning or a dead link is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

notebooks: $(TESTING)  ## a notebook of every tutorial, made from its Markdown, in the folder notebooks
	$(BIN)/python docs/notebooks.py --out notebooks

help:
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/:/'
