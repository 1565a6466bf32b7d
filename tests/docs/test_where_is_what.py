"""The table of a stranger's questions: each file is there and defines the name."""

import re
from importlib import import_module

import pytest

from tests.docs.names import ROOT

PAGE = ROOT / "docs" / "howto" / "where_is_what.md"
ROW = re.compile(r"^\| (.+\?) \| `(\S+)\.py` \| `(\w+)` \|$", re.MULTILINE)
ROWS = ROW.findall(PAGE.read_text())


def defines(path, name):
    """Whether a module of the package has a name of its own, not one that it imports."""
    words = path.split("/")
    home = ".".join(words if words[0] == "cdpr_drake" else ["cdpr_drake", *words])
    found = getattr(import_module(home), name, None)
    return found is not None and getattr(found, "__module__", home) == home


def test_every_row_is_a_question():
    assert len(ROWS) >= 20
    assert PAGE.read_text().count("\n| ") == len(ROWS) + 1  # and the head of the table


@pytest.mark.parametrize(("question", "path", "name"), ROWS, ids=[row[2] for row in ROWS])
def test_the_answer_is_there(question, path, name):
    assert (ROOT / f"{path}.py").is_file()
    assert defines(path, name), f"{path} does not define {name}"


def test_what_is_only_imported_does_not_count():
    assert not defines("cdpr_drake/statics/forward_kinematics", "CableSet")
    assert not defines("cdpr_drake/statics/forward_kinematics", "Kinematics")
