# Every target makes what it needs: a virtual environment in .venv with the locked dependencies.
PYTHON ?= python3
BIN := .venv/bin
OUT ?= demo-output
STUDIES ?= build/studies
HYPOTHESIS ?= explore
# The tests of a file run in one process; their bytecode is kept, as rewriting it takes a third of the collection.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

# Tests and studies run in as many processes as there are processors; each does its algebra alone.
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test test-all check lint pages docs studies bench lock clean

demo: .venv/runtime.stamp ## simulate the flexible arm, identify its friction, land it, write the reports
	$(BIN)/stickslip demo --out $(OUT)

test: .venv/dev.stamp ## the tests of the package without those marked slow, in four minutes on two cores
	$(PYTEST) -m "not slow" tests src

test-all: .venv/dev.stamp ## every test, with new examples of the property tests
	$(PYTEST) --hypothesis-profile=$(HYPOTHESIS)

check: lint pages ## linters, types, import contracts, docs with warnings as errors; -j 2 makes both at once

lint: .venv/dev.stamp
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports

pages: .venv/dev.stamp
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html

docs: .venv/dev.stamp ## the documentation, with its figures
	$(BIN)/python -m studies.documentation.figures
	$(BIN)/python -m studies.documentation.pulse_figures
	$(BIN)/python -m studies.documentation.conjunction_figures
	$(BIN)/python -m studies.documentation.friction_laws
	$(BIN)/python -m studies.documentation.exports
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

studies: .venv/dev.stamp ## the Monte Carlo studies in the documentation, and van de Wijdeven (2002); some ninety minutes
	$(BIN)/python -m studies.documentation.variants
	$(BIN)/python -m studies.documentation.estimators
	$(BIN)/python -m studies.documentation.pid_tuning
	$(BIN)/python -m studies.documentation.controllers
	$(BIN)/python -m studies.documentation.limits
	$(BIN)/python -m studies.documentation.landing
	$(BIN)/python -m studies.van_de_wijdeven part-a --out $(STUDIES)/part-a
	$(BIN)/python -m studies.van_de_wijdeven part-b --out $(STUDIES)/part-b
	$(BIN)/python -m studies.van_de_wijdeven conjunction --out $(STUDIES)/conjunction

bench: .venv/dev.stamp ## speed and accuracy beside other tools, in one run
	$(BIN)/python -m benchmarks

lock: ## resolve the dependencies anew (needs uv)
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
		--extra parquet --extra hdf5 --group build pyproject.toml -o requirements/runtime.lock
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
		--all-extras --group build --group test --group check --group docs -c requirements/runtime.lock \
		pyproject.toml -o requirements/dev.lock

.venv/runtime.stamp: requirements/runtime.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements/runtime.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

.venv/dev.stamp: requirements/dev.lock .venv/runtime.stamp
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements/dev.lock
	touch $@

clean:
	rm -rf .venv docs/_build demo-output
