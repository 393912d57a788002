# From a fresh clone: `make replicate` sets up and runs the pipeline, `make test` sets up and tests.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
JOBS ?= 2
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready

ifneq ($(word 2,$(abspath $(VENV))),)
$(error the environment in "$(CURDIR)" would have a blank in its name, which Snakemake does not survive; put it elsewhere: make VENV=/a/place)
endif

# A process that finds no bytecode compiles all that it imports, which is half of a short job; some shells forbid to keep it.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: replicate quick test check lint docs gallery benchmark synthetic lock cluster clean numba-oldest numba-newest

# $(call timed,name,command): runs a command that may be silent, and prints the time that it takes, with that of its last end here
timed = @begin=$$(date +%s); last=$$(sed 's/$$/ s the last time/' $(VENV)/took-$(1) 2>/dev/null); echo "$(1): $${last:-not timed here yet}"; \
    (while sleep 50 && kill -0 $$$$ 2>/dev/null; do echo "$(1): $$(($$(date +%s) - begin)) s so far; $${last:-not timed here yet}"; done) & tick=$$!; \
    trap "kill $$tick" EXIT; trap "exit 130" INT TERM; $(2) && took=$$(($$(date +%s) - begin)) && echo $$took > $(VENV)/took-$(1) && echo "$(1): took $$took s"

replicate: $(READY)
	$(call timed,replicate,$(BIN)/python workflow/run.py -j$(JOBS))
	@echo "open results/report.html in a browser"

quick: $(READY)
	$(call timed,quick,$(BIN)/python workflow/run.py -j$(JOBS) --configfile config/quick.yaml)
	@echo "open results/quick/report.html in a browser"

test: $(READY)
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder $(PYTEST)

# the kernels on the oldest numba that pyproject.toml allows and on the newest there is, each in an environment of its own
numba-oldest: NUMBA := numba==$(shell sed -n 's/.*"numba>=\([0-9.]*\)".*/\1/p' pyproject.toml)
numba-newest: NUMBA := numba
numba-oldest numba-newest:
	$(PYTHON) -m venv $(VENV)/$@
	$(VENV)/$@/bin/python -m pip install --quiet --upgrade --upgrade-strategy eager '$(NUMBA)' pytest --editable .
	$(VENV)/$@/bin/python -m pytest -p no:cacheprovider tests/test_jit.py tests/contact/test_laws.py tests/simulation/test_settled_loops.py

check: lint
	$(BIN)/python -m pytest -n auto --dist loadfile --no-kernels -m "not slow"

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(READY)
	$(call timed,docs,$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_site)

gallery: $(READY)
	$(BIN)/jupyter execute --inplace --NotebookClient.record_timing=False docs/gallery/*.ipynb

benchmark: $(READY)
	$(BIN)/python benchmarks/cost.py --out results/benchmarks/cost.json

cluster: $(READY)
	$(BIN)/python tests/workflow/cluster.py

synthetic: $(READY)
	$(BIN)/python -m trackdyn_replication.synthetic

# versions stay, but for the packages in NEW and what these make necessary
lock: $(READY)
	$(BIN)/python -m pip install --quiet 'uv>=0.9'
	$(BIN)/uv pip compile --quiet pyproject.toml --all-extras --universal --python-version 3.11 --generate-hashes --no-annotate \
	    --custom-compile-command 'make lock' $(addprefix --upgrade-package ,$(NEW)) --output-file requirements.lock

$(READY): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "CPython 3.11 or newer is needed; set PYTHON="'
	$(PYTHON) -m venv $(VENV)
	@echo "installing $$(grep -c == requirements.lock) packages"
	if $(BIN)/python -c 'import platform as p, sys; sys.exit(p.python_implementation() != "CPython" or sys.version_info >= (3, 14) or sys.platform not in ("linux", "darwin"))'; then \
	    $(BIN)/python -m pip install --progress-bar off --no-deps --no-compile --require-hashes --requirement requirements.lock && \
	    $(BIN)/python -m pip install --quiet --no-deps --editable .; \
	else \
	    echo "requirements.lock is for CPython 3.11 to 3.13 on Linux and macOS; here its versions are taken, unverified" && \
	    sed -n 's/^\([a-z0-9._-]*==[^ ]*\).*/\1/p' requirements.lock > $(VENV)/versions.txt && \
	    $(BIN)/python -m pip install --progress-bar off --constraint $(VENV)/versions.txt --editable '.[test,docs,peers,cluster]'; \
	fi
	touch $(READY)

clean:
	rm -rf .venv .snakemake
	find results -mindepth 1 ! -name README.md -delete
