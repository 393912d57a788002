# From a fresh clone: `make replicate` sets up and runs the pipeline, `make test` sets up and tests.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
JOBS ?= 2
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready

ifneq ($(word 2,$(CURDIR)),)
$(error the folder "$(CURDIR)" has a blank in its name, which the interpreters of the pipeline do not survive; move it)
endif

.PHONY: replicate quick test lint benchmark synthetic cluster clean

replicate: $(READY)
	$(BIN)/python workflow/run.py -j$(JOBS)

quick: $(READY)
	$(BIN)/python workflow/run.py -j$(JOBS) --configfile config/quick.yaml

test: $(READY)
	$(BIN)/python -m pytest

lint: $(READY)
	$(BIN)/ruff check .

benchmark: $(READY)
	$(BIN)/python benchmarks/cost.py --out results/benchmarks/cost.json

synthetic: $(READY)
	$(BIN)/python -m trackdyn.synthetic

cluster: $(READY)
	$(BIN)/python workflow/cluster/show.py $(SIZE)

$(READY): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "CPython 3.11 or newer is needed; set PYTHON="'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --editable .
	touch $(READY)

clean:
	rm -rf $(VENV) results .snakemake
