"""The gallery's notebooks that are offered with their output: run, cell by cell, when the documents are built."""

from __future__ import annotations

import os
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from traitlets.config import Config

LONGEST_S = 1200
"""A cell that takes longer is an error."""

PRIVATE = Config({"KernelManager": {"transport": "ipc"}} if os.name == "posix" else {})
"""Sockets in the file system, which other users of the machine cannot reach; Windows has none."""

SHOWING = os.environ | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}
"""Figures go into the notebook, whatever this process draws with."""


def execute(path: Path) -> nbformat.NotebookNode:
    """Run a notebook from its first cell to its last, and put what it shows into it; the first error ends it.

    One that has been run is left as it is: sphinx-gallery writes it anew, without output, when its program changes.
    """
    notebook = nbformat.read(path, as_version=4)
    if any(cell.cell_type == "code" and cell.execution_count is None for cell in notebook.cells):
        NotebookClient(notebook, timeout=LONGEST_S, kernel_name="python3", config=PRIVATE).execute(env=SHOWING)
        nbformat.write(notebook, path)
    return notebook
