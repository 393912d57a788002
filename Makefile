# From a fresh clone: `make replicate` sets up and runs the pipeline, `make test` sets up and tests.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
JOBS ?= 2
VENV := .venv
BIN := $(VENV)/bin
# all that the pipeline runs with; and, for every other target, what tests and pages need, too
PIPELINE := $(VENV)/pipeline
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

replicate: $(PIPELINE)
	$(call timed,replicate,$(BIN)/python workflow/run.py -j$(JOBS))
	@echo "open results/report.html in a browser"

quick: $(PIPELINE)
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

synthetic: $(PIPELINE)
	$(BIN)/python -m trackdyn_replication.synthetic

# versions stay, but for the packages in NEW and what these make necessary; those of the pipeline come first
OTHERS := \# for tests and pages
COMPILE = $(BIN)/uv pip compile --quiet pyproject.toml --universal --python-version 3.11 --no-annotate
lock: $(READY)
	$(BIN)/python -m pip install --quiet 'uv>=0.9'
	$(COMPILE) --all-extras --generate-hashes --custom-compile-command 'make lock' $(addprefix --upgrade-package ,$(NEW)) \
	    --output-file requirements.lock
	$(COMPILE) --extra pipeline --extra peers --constraint requirements.lock > $(VENV)/names.txt
	awk 'FNR == NR {pipeline[$$1]; next} /^[^ #]/ {needed = $$1 in pipeline} /^#/ || needed {print; next} {rest = rest $$0 "\n"} \
	    END {printf "$(OTHERS)\n%s", rest}' $(VENV)/names.txt requirements.lock > $(VENV)/requirements.lock
	mv $(VENV)/requirements.lock requirements.lock

# $(call install,file,extras): installs the versions of a lock file; where it is not valid those of some extras, unverified
define install
	@echo "installing $$(grep -c == $(1)) packages"
	if $(BIN)/python -c 'import platform as p, sys; sys.exit(p.python_implementation() != "CPython" or sys.version_info >= (3, 14) or sys.platform not in ("linux", "darwin"))'; then \
	    $(BIN)/python -m pip install --progress-bar off --no-deps --no-compile --require-hashes --requirement $(1); \
	else \
	    echo "requirements.lock is for CPython 3.11 to 3.13 on Linux and macOS; here its versions are taken, unverified" && \
	    sed -n 's/^\([a-z0-9._-]*==[^ ]*\).*/\1/p' requirements.lock > $(VENV)/versions.txt && \
	    $(BIN)/python -m pip install --progress-bar off --constraint $(VENV)/versions.txt --editable '.[$(2)]'; \
	fi
endef

$(PIPELINE): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "CPython 3.11 or newer is needed; set PYTHON="'
	$(PYTHON) -m venv $(VENV)
	sed '/^$(OTHERS)/,$$d' requirements.lock > $(VENV)/pipeline.lock
	$(call install,$(VENV)/pipeline.lock,pipeline$(COMMA)peers)
	$(BIN)/python -m pip install --quiet --no-deps --editable .
	touch $(PIPELINE)

COMMA := ,
$(READY): $(PIPELINE)
	sed '1,/^$(OTHERS)/d' requirements.lock > $(VENV)/others.lock
	$(call install,$(VENV)/others.lock,test$(COMMA)docs$(COMMA)peers$(COMMA)cluster)
	touch $(READY)

clean:
	rm -rf .venv .snakemake
	find results -mindepth 1 ! -name README.md -delete
