"""Columns, keys and values that studies ask for: a misspelt one fails here, without a run.

A name that is asked of runs has to be written where nothing is asked, too: where a row is made, or
a case planned. Names that are put together there are listed.
"""

import ast
from functools import cache
from pathlib import Path

import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import judged
from cdpr_drake.analyses.studies.framework.study import Form

ROOT = Path(__file__).parents[3]
ROOMS = ("analyses", "systems", "models", "cdpr_drake")

OF_COLUMNS = {
    "mean", "means", "median", "largest", "smallest", "total", "counts", "counted", "list", "by",
}  # fmt: skip
"""Methods of runs whose arguments are names of columns."""

OF_KEYS = OF_COLUMNS | {"one", "has"}
"""Methods of runs whose keyword arguments are names of columns, with values."""

RUNS = ("runs", "rows", "some", "mine")
"""Names of runs that are called to pick some of them."""

PUT_TOGETHER = {
    "holds_static", "holds_wrench-closure", "certified_poses", "searched_poses", "searched_m3",
    "camera_x_m", "error_m", "r_s_m", "r_pc_m", "theta_u_deg", "camera_turn_deg",
    "certified_percent", "interval_percent", "lipschitz_percent", "m_1",
}  # fmt: skip
"""Columns whose names are made of a kind, a verdict, a method or an error, and a unit, and a
configuration whose name is made of its group and estimator."""


def asked(tree):
    """Nodes that ask runs for something: the node, and the column, key or value."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and is_word(node.slice):
            yield node.slice, node.slice.value
        if not isinstance(node, ast.Call):
            continue
        method = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        if method in OF_COLUMNS:
            yield from ((one, one.value) for one in node.args if is_word(one))
        if method in OF_KEYS or (isinstance(node.func, ast.Name) and node.func.id in RUNS):
            for keyword in node.keywords:
                yield keyword, keyword.arg or ""
                if isinstance(keyword.value, (ast.Constant, ast.Tuple, ast.List)):
                    words = filter(is_word, ast.walk(keyword.value))
                    yield from ((one, one.value) for one in words)


def is_word(node):
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def written(tree, without):
    """Names and words of a file but those of some nodes."""
    for node in ast.walk(tree):
        if id(node) in without:
            continue
        for name in ("id", "arg", "attr", "value"):
            word = getattr(node, name, None)
            if isinstance(word, str):
                yield word


@cache
def names(text):
    """What a file asks for, and the names and words that it writes besides."""
    tree = ast.parse(text)
    mine = list(asked(tree))
    return {word for _, word in mine}, set(written(tree, {id(node) for node, _ in mine}))


@cache
def files():
    """Text of each file of the package."""
    return {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
        if not any(folder.is_symlink() for folder in path.parents)
    }


def unknown(texts):
    """What studies ask for that is written nowhere else."""
    studies = {
        name: names(text) for name, text in texts.items() if name.startswith("analyses/studies/")
    }
    assert len(studies) > 100
    left = set().union(*(some for some, _ in studies.values()))
    left -= PUT_TOGETHER.union({""}, *(words for _, words in studies.values()))
    for text in (text for name, text in texts.items() if name not in studies):
        if any(word in text for word in left):  # only such files are parsed
            left -= names(text)[1]
    return sorted((word, name) for name, (some, _) in studies.items() for word in some & left)


def test_what_studies_ask_for_is_written_where_rows_are_made():
    assert unknown(files()) == []


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ('runs.means("image_max_px"', 'runs.means("image_mx_px"'),
        ('run["outcome"]', 'run["outcom"]'),
        ('runs(configuration="E4")', 'runs(configration="E4")'),
        ('runs(configuration="E4")', 'runs(configuration="E44")'),
    ],
)
def test_a_misspelling_is_found(right, wrong):
    name = "analyses/studies/case_studies/case_6.py"
    text = files()[name]
    assert right in text
    assert len(unknown(files() | {name: text.replace(right, wrong)})) == 1


@pytest.mark.parametrize("name", list(STUDIES))
def test_what_statements_ask_first_is_planned(name):
    """Without any run each ends where it lacks some, and not in a name that nobody planned."""
    study = STUDIES[name].run
    planned = study.planned(Form())
    said = judged(study.checks, Runs((), lambda: planned))
    assert [one.name for one in said] == [check.name for check in study.checks]
    assert [one.found for one in said if "judging failed" in one.found] == []
