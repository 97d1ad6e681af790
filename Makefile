# make          set up .venv, build the workbooks, execute the notebooks
# make test     run every test
# make bench    measure, beside the peers
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/ready

.PHONY: all workbooks notebooks test format bench pin clean
.DEFAULT_GOAL := all

all: workbooks notebooks
	@echo
	@echo "Open a workbook, say workbooks/football.xlsx, in any spreadsheet program,"
	@echo "and the notebooks with: $(BIN)/jupyter lab notebooks"

$(READY): environment.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and \
	    "kfsheet needs Python 3.11 or newer; name one: make PYTHON=python3.12")'
	@echo "Setting up .venv; this takes a minute or two, once."
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r environment.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

workbooks: $(READY)
	$(BIN)/kfsheet build

notebooks: $(READY)
	$(BIN)/python tools/execute_notebooks.py

test: $(READY)
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --quiet --check .
	$(BIN)/python -m pytest -n 2
	TQDM_DISABLE=1 $(BIN)/python -m pytest -o addopts= --nbval -n 2 --dist loadfile notebooks

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r benchmarks/requirements.txt
	$(BIN)/python benchmarks/bench.py

# After a change of pyproject.toml; needs uv, which `pip install uv` brings.
pin:
	echo "# Every package at its version. Made from pyproject.toml by: make pin" > environment.txt
	uv pip compile -q --universal --python-version 3.11 --all-extras --no-header --no-annotate \
	    pyproject.toml >> environment.txt

clean:
	rm -rf .venv
