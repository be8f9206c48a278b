# The two commands: `make demo` runs the main job, `make test` runs the tests. `make help` lists all.

PYTHON ?= python3
VENV ?= .venv
JOBS ?= 2

BIN := $(VENV)/bin
STAMP := $(VENV)/.ok
UV := $(shell command -v uv 2>/dev/null)

# What one process has compiled or rewritten is for the others too.
unexport PYTHONDONTWRITEBYTECODE

DEMO_ODD := odd/motorway_chauffeur.yaml
DEMO_REPORT := reports/motorway_chauffeur.html

.DEFAULT_GOAL := help
.PHONY: help env demo test server slow rest full parity chaos check lint types docs kernels wheel \
	versions bench clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)$$/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 14

env: $(STAMP)  ## create the environment in .venv

$(STAMP): pyproject.toml constraints.txt
ifdef UV
	test -x $(BIN)/python || uv venv --quiet --no-python-downloads --python $(PYTHON) $(VENV)
	uv pip install --quiet --python $(BIN)/python --compile-bytecode -c constraints.txt -e '.[dev]'
else
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --compile \
		-c constraints.txt -e '.[dev]'
endif
	touch $@

demo: $(STAMP)  ## run the motorway ODD; write its report
	$(BIN)/adeye run $(DEMO_ODD) --report $(DEMO_REPORT)

# What the tests of a file share is made once: a file is for one process.
test: $(STAMP)  ## run the tests
	$(BIN)/adeye warmup --quiet
	$(BIN)/pytest -n $(JOBS) --dist loadfile -m "not slow and not server"

server: $(STAMP)  ## run the tests on a PostgreSQL server of their own
	$(BIN)/pytest -n $(JOBS) --dist loadfile -m "server and not slow"

slow: $(STAMP)  ## run the tests that take long
	$(BIN)/pytest -n $(JOBS) --dist loadfile -m slow

# In random order, as much as fits the time. Seconds, of which the last test may take more.
BUDGET ?= 300
rest: $(STAMP)  ## run what `make test` leaves out, as far as it fits BUDGET=300 seconds
	$(BIN)/pytest -n $(JOBS) --dist loadfile -m "slow or server" --budget $(BUDGET)

full: test server slow check kernels versions  ## run everything; takes hours

# Both traffic implementations judge alike: two ODDs in full and a sample of the million.
CASES ?= 1000
parity: $(STAMP)  ## compare the verdicts of both traffic implementations (CASES=1000)
	PARITY_CASES=$(CASES) $(BIN)/pytest -n $(JOBS) -m slow tests/test_backends.py

# One after the other: they count, fill disks and measure. The figures go to reports/chaos.
chaos: $(STAMP)  ## kill, fill up, tear and repeat campaigns in full size; takes two hours
	CHAOS=full FUZZ=2000 $(BIN)/pytest -n 0 -p no:randomly -rs -s -m chaos tests/chaos

check: lint types docs wheel  ## everything else that must hold before a merge (-j2: faster)

lint: $(STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/codespell
	$(BIN)/python -m adeye.spec.schema --check docs/schema

types: $(STAMP)
	$(BIN)/mypy --strict adeye tests

docs: $(STAMP)
	$(BIN)/pytest --doctest-modules --ignore=adeye/store/migrations adeye

kernels: $(STAMP)  ## run the kernels as plain Python: nothing may hang on the compiler
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest -n $(JOBS) -m "not slow" tests/kernel $(if $(BRIEF),--budget $(BRIEF))

wheel: $(STAMP)
	.ci/lean_install $(BIN)/python

# Each end of the bounds in a fresh environment; it downloads both.
versions: $(STAMP)  ## try the lowest and the newest versions of what the package depends on
	.ci/versions $(BIN)/python

bench: $(STAMP)  ## measure: one question per file in benchmarks/
	@for file in benchmarks/*.py; do \
		case $$file in */sumo.py) $(BIN)/python -c "import libsumo" 2>/dev/null || continue;; \
			*/lane_ends.py) command -v sumo netconvert >/dev/null || continue;; esac; \
		echo "== $$file"; $(BIN)/python $$file || exit 1; \
	done

clean:  ## remove the environment, caches and generated reports
	rm -rf $(VENV) .coverage .coverage.* .hypothesis .import_linter_cache .mypy_cache \
		.pytest_cache .ruff_cache build dist
	find adeye tests benchmarks -type d -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true
	find reports -mindepth 1 -maxdepth 1 ! -name baselines -exec rm -rf {} + 2>/dev/null || true
