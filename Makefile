# Every target makes the virtual environment that it needs, once, and again when pyproject.toml
# changes. PYTHON=... chooses the interpreter, WORKERS=... the number of test processes.

MINIMUM := $(shell sed -n 's/^requires-python *= *">= *\([0-9.]*\)"$$/\1/p' pyproject.toml)

comma := ,
# $(call check-python,RELATION): exits with success if Python stands in this relation to the minimum
# and can make environments.
check-python = import sys, ensurepip, venv; \
	sys.exit(not sys.version_info[:2] $(1) ($(subst .,$(comma),$(MINIMUM))))
# $(call find-python,RELATION,COMMANDS): the first of the commands that passes the check.
find-python = $(shell for python in $(2); do \
	$$python -c '$(call check-python,$(1))' 2>/dev/null && echo $$python && break; done)

PYTHON ?= $(call find-python,>=,python3 python$(MINIMUM) python3.12 python3.13 python3.14 python)
# The floors have wheels for the oldest Python only.
FLOORS_PYTHON ?= $(call find-python,==,python$(MINIMUM) $(PYTHON) python3)
WORKERS ?= auto

DEMO := .venv
DEV := .venv-dev
FLOORS := .venv-floors
WHEEL := .venv-wheel

export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_QUIET := 1
export MPLBACKEND := Agg
# Some machines forbid Python to keep the bytecode that it makes. Then each of the many processes that
# tests start makes that of every library again, for several seconds.
unexport PYTHONDONTWRITEBYTECODE

# $(call make-venv,FOLDER,PYTHON,RELATION): the pip of an older Python knows no dependency groups.
# Bytecode is made of what is imported, when it is: all of it takes twice as long to install.
define make-venv
	@$(or $(2),false) -c '$(call check-python,$(3))' 2>/dev/null || { echo "This needs Python $(3) $(MINIMUM)" \
		"with the modules venv and ensurepip; $(or $(2),no command found) is not that." \
		"Name one with PYTHON=... (for the floors FLOORS_PYTHON=...)."; exit 1; }
	$(2) -m venv --clear $(1)
	$(1)/bin/python -m pip install --no-compile "pip>=25.1"
endef
pip-install = $(1)/bin/python -m pip install --no-compile

# One BLAS thread per process: more wait for each other on matrices of this size, and take twice the
# processor time to build the pages. What the wheel is tested with has as many as it likes, as with
# its users.
test fuzz test-floors docs first-hour: export OMP_NUM_THREADS := 1
test fuzz test-floors docs first-hour: export OPENBLAS_NUM_THREADS := 1

# No more processes than four where their number is left open: each pays for its imports.
pytest = $(1)/bin/python -m pytest -n $(WORKERS) --maxprocesses 4 --dist worksteal

.PHONY: help demo test fuzz lint format test-floors wheel check-dist test-wheel docs benchmarks first-hour release clean

help:
	@echo "make demo         run the gyro example and save its pictures in figures/"
	@echo "make test         all tests and docstring examples, newest dependencies"
	@echo "make fuzz         the properties alone, on fifty times as much that is drawn anew; 1,000 logs"
	@echo "make lint         style, format, types"
	@echo "make format       put style and format right where a tool can"
	@echo "make test-floors  the tests at the oldest dependencies that pyproject.toml allows"
	@echo "make test-wheel   the built wheel, away from the source: modules, files, every way out"
	@echo "make wheel        sdist and wheel, in dist/"
	@echo "make check-dist   what a package index and an installer would object to in these"
	@echo "make docs         the documentation, in docs/_build/html"
	@echo "make first-hour   two users' first hours with the built wheel, and what they see"
	@echo "make release URL=https://HOST/OWNER/skanfis [DRY=1]   all checks, then tag and publish"
	@echo "make benchmarks   the benchmarks that take minutes; --help lists the others"
	@echo "make clean        remove environments and everything that was built"

$(DEMO)/.installed: pyproject.toml
	$(call make-venv,$(DEMO),$(PYTHON),>=)
	$(call pip-install,$(DEMO)) --editable ".[plot]"
	@touch $@

$(DEV)/.installed: pyproject.toml
	$(call make-venv,$(DEV),$(PYTHON),>=)
	$(call pip-install,$(DEV)) --editable ".[docs]" --group dev
	@touch $@

$(FLOORS)/.installed: pyproject.toml .ci/floors.py
	$(call make-venv,$(FLOORS),$(FLOORS_PYTHON),==)
	$(FLOORS)/bin/python .ci/floors.py > $(FLOORS)/floors.txt
	$(call pip-install,$(FLOORS)) --editable ".[plot,allan,onnx,dask]" --group test --constraint $(FLOORS)/floors.txt
	@touch $@

demo: $(DEMO)/.installed
	$(DEMO)/bin/python examples/plot_gyro_compensation.py figures

test: $(DEV)/.installed
	$(call pytest,$(DEV))

fuzz: $(DEV)/.installed
	$(call pytest,$(DEV)) tests/properties --hypothesis-profile fuzz --hypothesis-show-statistics
	LOG_VARIANTS=1000 $(call pytest,$(DEV)) tests/gyro/test_log_variants.py

lint: $(DEV)/.installed
	$(DEV)/bin/ruff check
	$(DEV)/bin/ruff format --check
	$(DEV)/bin/mypy

format: $(DEV)/.installed
	$(DEV)/bin/ruff check --fix
	$(DEV)/bin/ruff format

# What README, the pages, the docstrings and the examples print is compared at the newest
# dependencies. So is theory: whether formulas hold case by case, compiled code answers as Python
# does, and what is learnt is true. No version of a library decides it, and what is left reaches
# every line of the package that all tests reach. MARKS= runs all of tests/.
MARKS ?= not page and (floors or not theory)
test-floors: $(FLOORS)/.installed
	@echo "The floors:" $$(cat $(FLOORS)/floors.txt)
	$(call pytest,$(FLOORS)) tests -m "$(MARKS)"

wheel: $(DEV)/.installed
	rm -rf dist
	$(DEV)/bin/python -m build --no-isolation --outdir dist

check-dist: wheel
	$(DEV)/bin/python -m twine check --strict dist/*
	$(DEV)/bin/check-wheel-contents --package skanfis --package-omit "__pycache__,*.pyc" dist/*.whl

# With nothing but what it asks for itself and pytest: what a wheel may lack is files, modules and
# what they need; what they compute has been tested. The pip is that of the environment beside it.
$(WHEEL)/.installed: wheel
	$(PYTHON) -m venv --clear --without-pip $(WHEEL)
	wheel=$$(echo dist/*.whl) && $(DEV)/bin/python -m pip --python $(WHEEL)/bin/python install \
		--no-compile "$$wheel[plot]" pytest
	@touch $@

test-wheel: $(WHEEL)/.installed
	@set -e; away=$$(mktemp -d); trap 'rm -rf "$$away"' EXIT; trap 'exit 1' INT TERM; \
	mkdir "$$away/tests"; cp tests/conftest.py tests/leftovers.py tests/test_installed.py "$$away/tests"; \
	cp pyproject.toml "$$away"; python="$$PWD/$(WHEEL)/bin/python"; cd "$$away"; \
	$$python -c "import skanfis; print('Testing', skanfis.__file__); assert '$(WHEEL)' in skanfis.__file__"; \
	$$python -m pytest tests

docs: $(DEV)/.installed
	$(DEV)/bin/python -m sphinx --fail-on-warning --keep-going docs docs/_build/html
	$(DEV)/bin/python .ci/check_links.py docs/_build/html
	@echo "Documentation: $(CURDIR)/docs/_build/html/index.html"

# The address, date and version are written first, so that everything below is checked as it will be
# published. twine asks for the credentials, or takes them from its own settings.
release: $(DEV)/.installed
	$(DEV)/bin/python .ci/release.py prepare --url "$(URL)" $(if $(DRY),--dry-run)
	.ci/run
	$(MAKE) check-dist
	$(if $(DRY),@echo "A rehearsal: nothing was tagged or uploaded.",$(DEV)/bin/python .ci/release.py tag)
	$(if $(DRY),@true,$(DEV)/bin/python -m twine upload dist/*)

# In the environment of the built wheel, which is what a user installs.
first-hour: $(WHEEL)/.installed
	$(WHEEL)/bin/python .ci/first_hour.py $(CURDIR)/$(WHEEL)/bin/python

benchmarks: $(DEV)/.installed
	$(DEV)/bin/python -m benchmarks

clean:
	rm -rf $(DEMO) $(DEV) $(FLOORS) $(WHEEL) build dist figures
	rm -rf .mypy_cache .pytest_cache .ruff_cache
	rm -rf docs/_build docs/auto_examples docs/generated docs/sg_execution_times.rst
	find skanfis tests examples benchmarks docs -type d -name __pycache__ -exec rm -rf {} +
