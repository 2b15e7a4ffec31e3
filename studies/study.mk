# Shared by all studies: `make` in a study's folder runs it from the root of the checkout, in its environment.
ROOT := $(abspath $(dir $(lastword $(MAKEFILE_LIST)))..)
HERE := studies/$(notdir $(CURDIR))
CORES ?= all
SNAKEMAKE := cd $(ROOT) && .venv/bin/snakemake --cores $(CORES)
PYTHON := cd $(ROOT) && PYTHONPATH=studies .venv/bin/python
# The first target of a study; `make setup` brings what the root's `make` needs.
.PHONY: all setup
all:

setup:
	@$(MAKE) --no-print-directory -C $(ROOT) .venv/set-up
