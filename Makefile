# make          set up .venv, build the workbooks, execute the notebooks; again only what changed
# make quick    set up what workbooks need, and build them
# make test     run every test
# make lowest   run the tests with the oldest packages that pyproject.toml allows
# make wheel    build a wheel and an sdist, and try them in an empty environment
# make bench    measure, beside the peers
PYTHON ?= python3
OLDEST ?= $(shell command -v python3.11 || echo $(PYTHON))
BIN := .venv/bin
CORE := .venv/core
READY := .venv/ready
# Python compiles a module when it is first imported: pip, which compiles all, takes twice as long.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# seconds since .venv was begun, for who wonders where the time goes
NOW = $$(( $$(date +%s) - $$(cat .venv/begun) )) s

.PHONY: all quick workbooks notebooks test format lowest wheel bench pin clean
.DEFAULT_GOAL := all

all: workbooks notebooks
	@echo
	@echo "Open a workbook, say workbooks/football.xlsx, in any spreadsheet program,"
	@echo "and the notebooks with: $(BIN)/jupyter lab notebooks"

quick: workbooks

# What `build` needs, so that there are workbooks before the rest is downloaded.
$(CORE): environment.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and \
	    "kfsheet needs Python 3.11 or newer; name one: make PYTHON=python3.12")'
	@echo "Setting up .venv for the workbooks; this takes half a minute, once."
	@$(PYTHON) -m venv .venv && date +%s > .venv/begun
	@$(PIP) -c environment.txt setuptools
	@$(PIP) -c environment.txt --no-build-isolation --config-settings editable_mode=compat -e .
	@echo "environment for the workbooks: $(NOW)"
	@touch $@

# uv is many times as fast; pip, which knows a mirror that pip is told of, where uv cannot.
$(READY): $(CORE)
	@echo "Setting up .venv for the notebooks and tests; this takes a minute, once."
	@date +%s > .venv/begun
	@$(PIP) -c environment.txt uv && \
	    $(BIN)/uv pip install --quiet --python $(BIN)/python -r environment.txt || \
	    $(PIP) -r environment.txt
	@echo "environment for the notebooks and tests: $(NOW)"
	@touch $@

workbooks: $(CORE)
	@$(BIN)/python tools/build_workbooks.py

notebooks: $(READY) workbooks
	@$(BIN)/python tools/execute_notebooks.py

test: $(READY)
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --quiet --check .
	$(BIN)/python -m pytest -n 2
	TQDM_DISABLE=1 $(BIN)/python -m pytest -o addopts= --nbval -n 2 --dist loadfile notebooks

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Warnings are no errors here: an old release may use what a newer one that it needs discourages.
# What looks at marks by the thousand knows no library that could be old, and runs once.
lowest: $(READY)
	$(BIN)/uv venv --quiet --clear --python $(OLDEST) .venv/lowest
	$(BIN)/uv pip install --quiet --python .venv/lowest --resolution lowest-direct -e '.[all,tests]'
	.venv/lowest/bin/python -m pytest -n 2 -W default --ignore tests/package \
	    $(addprefix --ignore tests/coursework/test_,battery.py judge.py marks_fuzz.py \
	    questions_sheet.py rearrangements.py)

wheel: $(READY)
	$(BIN)/python tools/try_wheel.py

bench: $(READY)
	$(PIP) -r benchmarks/requirements.txt
	$(BIN)/python benchmarks/bench.py

# After a change of pyproject.toml.
pin: $(READY)
	echo "# Every package at its version. Made from pyproject.toml by: make pin" > environment.txt
	$(BIN)/uv pip compile -q --universal --python-version 3.11 --all-extras --no-header \
	    --no-annotate pyproject.toml >> environment.txt

clean:
	rm -rf .venv
