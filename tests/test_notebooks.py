"""Every notebook runs from top to bottom, and is committed without outputs."""

import hashlib
import re
from pathlib import Path

import nbformat
import pytest
from jupyter_core.utils import run_sync
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))

EXECUTED = Path(__file__).parent.parent / ".executed_notebooks"
"""Where the site finds notebooks with their outputs, each under the hash of its source."""

CELL_TIMEOUT = 7200
"""A cell that takes longer than this [s] hangs. Kernels may compile in it for a minute of a core;
on a busy machine that once took 400 s."""

BEGIN = """
get_ipython().reset()
import logging, os, sys
logging.getLogger("cdpr_drake.kernel_cache.first_use").setLevel(logging.ERROR)
if "matplotlib.pyplot" in sys.modules:
    sys.modules["matplotlib.pyplot"].close("all")
methods = sys.modules.get("cdpr_drake.tensions.methods")
if methods is not None:
    for name in [name for name, one in methods.METHODS.items() if one.user_program is not None]:
        del methods.METHODS[name]
os.chdir({folder!r})
del logging, os, sys, methods
get_ipython().execution_count = 0
"""
"""Forgets what the notebook before has made: its names, numbers of cells, open figures, folder,
its own methods of tensions. An empty cache of kernels is no matter of a notebook."""


@pytest.fixture(scope="module")
def kernel():
    """One process in which notebooks run, one after the other.

    Each begins without the names of the one before; what was imported and loaded stays, which takes
    longer than many a notebook.
    """
    starter = NotebookClient(nbformat.v4.new_notebook())
    manager = starter.create_kernel_manager()
    starter.start_new_kernel()
    yield manager
    run_sync(manager.shutdown_kernel)(now=True)


def execute(notebook, kernel, folder):
    """Runs all cells in a kernel; the outputs are put into the notebook."""
    client = NotebookClient(notebook, km=kernel, timeout=CELL_TIMEOUT)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(BEGIN.format(folder=str(folder))))
    try:
        client.execute()
    finally:
        notebook.cells.pop(0)
        if client.kc is not None:
            client.kc.stop_channels()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(path, kernel, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    execute(notebook, kernel, tmp_path)
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    # Nothing but what a cell says on purpose: no log line, no warning.
    assert [output.text for output in outputs if output.get("name") == "stderr"] == []
    assert any("image/png" in output.get("data", {}) for output in outputs)
    kept = EXECUTED / hashlib.sha256(path.read_bytes()).hexdigest()[:16] / path.name
    kept.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, kept)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_has_no_outputs(path):
    for cell in nbformat.read(path, as_version=4).cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


def links(path):
    """Files that the text of a notebook leads to."""
    cells = nbformat.read(path, as_version=4).cells
    words = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return set(re.findall(r"\]\(([^)#]*\.ipynb)\)", words))


def test_links_lead_somewhere_and_everywhere():
    names = {path.name for path in NOTEBOOKS}
    assert links(NOTEBOOKS[0].parent / "tour.ipynb") == names - {"tour.ipynb"}
    for path in NOTEBOOKS:
        assert links(path) <= names - {path.name}
        assert path.name == "tour.ipynb" or "tour.ipynb" in links(path)
