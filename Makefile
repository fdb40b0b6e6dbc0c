# make             sets up what is needed, in .venv, and says first what that is
# make reproduce   every figure, its numbers and report.html, in results/
# make lint        style and types
# make test        the tests, but the slow ones; with coverage: make test COVERAGE=--cov
# make test-slow   the slow tests
# make test-all    lint, test and test-slow
# make test-kernels   the numbers of reports and depth maps under several processor kernels and numbers of threads (slow)
# make docs        the documents as pages, in docs/_build/html; makes the figures first where there are none
# make links       asks every address on the web that the documents name, which needs the network
#
# All set up what they need first (PsychoPy and the tools of the tests: lint and test only), and redo that only when the pinned packages, or the sources of the page for browsers, change.
# Another Python: make PYTHON=python3.12 reproduce

SHELL := /bin/sh
export PYTHON
# Threads are ours (one a core); linear algebra that spins threads of its own only takes their time.
export OPENBLAS_NUM_THREADS = 1
# Compiled modules are kept, even where the environment forbids it: every process of the tests would compile all of them.
export PYTHONDONTWRITEBYTECODE =
run := .venv/bin/python
# On all cores, and one more process, as tests of windows and browsers wait more than they work; the tests of one file stay
# together, as they share what is made for them and the screens they open. In the order collected: the long ones first,
# the examples of docstrings last.
pytest := $(run) -m pytest --numprocesses $$($(run) -c "import os; print(1 + os.cpu_count())") --dist loadfile --no-loadscope-reorder

.PHONY: setup reproduce lint types types-of-tests test test-slow test-all test-kernels docs links clean

setup:
	@requirements/setup.sh setup

reproduce:
	@requirements/setup.sh reproduce
	@$(run) analysis/reproduce.py

lint:
	@requirements/setup.sh test
	$(run) -m ruff check
	$(run) -m ruff format --check
	@$(MAKE) --no-print-directory --jobs 2 --output-sync types types-of-tests

types:
	$(run) -m mypy

types-of-tests:
	$(run) -m mypy --config-file tests/mypy.ini

test:
	@requirements/setup.sh test
	$(pytest) -m "not slow" --durations 10 $(COVERAGE)

test-slow:
	@requirements/setup.sh test
	$(pytest) -m slow

test-all: lint test test-slow

test-kernels:
	@requirements/setup.sh test
	$(run) -m pytest tests/test_kernels.py

docs:
	@requirements/setup.sh reproduce
	@test -f results/report.html || $(run) analysis/reproduce.py
	$(run) -m sphinx -q -W --keep-going -b html docs docs/_build/html
	@echo docs/_build/html/index.html

links: docs
	$(run) -m sphinx -q -b linkcheck docs docs/_build/links

clean:
	rm -rf .venv results docs/_build docs/gallery docs/generated
