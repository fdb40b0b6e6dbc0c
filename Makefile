# make reproduce   every figure, its numbers and report.html, in results/
# make test        style, types and tests
#
# Both first set up what they need, in .venv, and redo that only when the pinned packages change.
# Another Python: make PYTHON=python3.12 reproduce

SHELL := /bin/sh
export PYTHON
# Threads are ours (one a core); linear algebra that spins threads of its own only takes their time.
export OPENBLAS_NUM_THREADS = 1
run := .venv/bin/python

.PHONY: reproduce test clean

reproduce:
	@requirements/setup.sh reproduce
	@$(run) analysis/reproduce.py

test:
	@requirements/setup.sh test
	$(run) -m ruff check
	$(run) -m ruff format --check
	$(run) -m mypy
	$(run) -m pytest

clean:
	rm -rf .venv results
