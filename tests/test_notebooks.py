"""Every notebook runs from top to bottom, and is committed without outputs."""

import hashlib
import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))

EXECUTED = Path(__file__).parent.parent / ".executed_notebooks"
"""Where the site finds notebooks with their outputs, each under the hash of its source."""

CELL_TIMEOUT = 7200
"""A cell that takes longer than this [s] hangs. Kernels may compile in it for a minute of a core;
on a busy machine that once took 400 s."""


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=CELL_TIMEOUT, resources={"metadata": {"path": tmp_path}}
    ).execute()
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
