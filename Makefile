# Every target makes what it needs: a virtual environment in .venv with the locked dependencies.
PYTHON ?= python3
BIN := .venv/bin
OUT ?= demo-output

.PHONY: demo test check docs study bench lock clean

demo: .venv/runtime.stamp ## simulate the flexible arm, identify its friction, land it, write the reports
	$(BIN)/stickslip demo --out $(OUT)

test: .venv/dev.stamp ## the whole test suite
	$(BIN)/python -m pytest -n auto

check: .venv/dev.stamp ## linters, types, import contracts, docs with warnings as errors
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/basedpyright
	$(BIN)/lint-imports
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html

docs: .venv/dev.stamp ## the documentation, with its figures made anew
	$(BIN)/python docs/make_figures.py
	$(BIN)/python docs/make_pulse_figures.py
	$(BIN)/python docs/make_conjunction_figures.py
	$(BIN)/python docs/make_friction_laws.py
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

study: .venv/dev.stamp ## the large Monte Carlo studies that the documentation shows (some eighty minutes)
	$(BIN)/python docs/make_study.py
	$(BIN)/python docs/make_estimators.py
	$(BIN)/python docs/make_pid_tuning.py
	$(BIN)/python docs/make_controller_study.py
	$(BIN)/python docs/make_limits.py
	$(BIN)/python docs/make_landing_study.py

bench: .venv/dev.stamp ## speed and accuracy beside other tools, in one run
	$(BIN)/python -m benchmarks

lock: ## resolve the dependencies anew (needs uv)
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
		--all-extras --group build pyproject.toml -o requirements/runtime.lock
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
