"""What pages name is there: keys, names, rooms, studies, and answers to a stranger's questions."""

import re
import runpy
import sys
from importlib import import_module

import pytest

from cdpr_drake.analyses.studies.study import STUDIES
from tests.docs.names import ROOT, unknown_names

PAGES = sorted(
    [*(ROOT / "docs").rglob("*.md"), *(ROOT / f"{name}.md" for name in (
        "README", "ARCHITECTURE", "CONTRIBUTING",
    ))]
)  # fmt: skip
QUESTIONS = (ROOT / "docs" / "howto" / "where_is_what.md").read_text()
ROW = re.compile(r"^\| (.+\?) \| `(\S+)\.py` \| `(\w+)` \|$", re.MULTILINE)
ROWS = ROW.findall(QUESTIONS)


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_keys_and_names_are_there(page):
    assert list(unknown_names(page.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    "span",
    ["cables.surplus", "controller.lambda_3=1", "robot.cabel_set()", "geometry.CableSett",
     "distribute_batsch", "no_such_function(robot)", "CableRobott"],
)  # fmt: skip
def test_what_is_not_there_is_found(span):
    assert list(unknown_names(f"Some words, `{span}`, and more.")) == [span]


@pytest.mark.parametrize(
    "span",
    ["perturbations.slack", "controller.lambda_0=1.5", "robot.cable_set()", "geometry.CableSet",
     "distribute_batch", "cables.CABLE_MODELS", "camera.fault", "log.csv", "X_WP"],
)  # fmt: skip
def test_what_is_there_is_not(span):
    assert list(unknown_names(f"Some words, `{span}`.\n\n```python\nno.such_thing()\n```\n")) == []


def test_the_picture_and_the_list_of_rooms_are_made_from_the_code(monkeypatch, capsys):
    program = str(ROOT / "docs" / "rooms.py")
    monkeypatch.setattr(sys, "argv", [program, "--check"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(program, run_name="__main__")
    assert (ended.value.code, capsys.readouterr().out) == (0, "")


def test_the_guide_s_table_has_every_study():
    guide = (ROOT / "docs" / "guides" / "studies.md").read_text(encoding="utf-8")
    table = re.split(r"^## ", guide.split("## Studies of this package\n")[1], flags=re.MULTILINE)[0]
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    names = [name for row in rows for name in re.findall(r"`([^`]+)`", row.split("|")[1])]
    assert {*names} - {"cdpr study"} == set(STUDIES)


def defines(path, name):
    """Whether a module of the package has a name of its own, not one that it imports."""
    words = path.split("/")
    home = ".".join(words if words[0] == "cdpr_drake" else ["cdpr_drake", *words])
    found = getattr(import_module(home), name, None)
    return found is not None and getattr(found, "__module__", home) == home


def test_every_row_of_a_stranger_s_table_is_a_question():
    assert len(ROWS) >= 10
    assert QUESTIONS.count("\n| ") == len(ROWS) + 1  # and the head of the table


@pytest.mark.parametrize(("question", "path", "name"), ROWS, ids=[row[2] for row in ROWS])
def test_the_answer_is_there(question, path, name):
    assert (ROOT / f"{path}.py").is_file()
    assert defines(path, name), f"{path} does not define {name}"


@pytest.mark.parametrize("name", ["CableSet", "Kinematics"])
def test_what_is_only_imported_does_not_count(name):
    assert not defines("cdpr_drake/statics/forward_kinematics", name)
