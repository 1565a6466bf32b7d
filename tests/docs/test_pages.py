"""Every code block of the site runs, and what the menu names is there."""

import os
import re
import shlex
from contextlib import nullcontext
from pathlib import Path

import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.logs.dialects import DIALECTS
from cdpr_drake.cli.app import main
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.tensions.methods import METHODS
from tests.cli.conftest import only

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
FIRST = DOCS / "start.md"
"""Its runs draw all their figures; elsewhere the replay stands for them, and for those of plans,
workspaces and stability, which their own tests look at."""

WHOLE = (FIRST, DOCS / "tutorial.md")
"""Pages whose runs go on to their end; those of others begin as their page says, and are short:
each scenario runs to its end where its own room is tested."""

SHORT = {"simulate": ["--duration", "0.5"], "reactions": ["--time", "0.2", "--after", "0.2"]}
"""Words that make a run short, whatever a page says before them."""

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page, language):
    return [code for kind, code in BLOCK.findall(page.read_text()) if kind == language]


def with_blocks(language):
    pages = [page for page in PAGES if blocks(page, language)]
    return pytest.mark.parametrize(
        "page", pages, ids=[str(page.relative_to(DOCS)) for page in pages]
    )


@pytest.fixture(autouse=True)
def tables_as_before():
    """Pages may add to tables of kinds; other tests do not see it."""
    kept = [(table, dict(table)) for table in (DIALECTS, ESTIMATORS, METHODS)]
    yield
    for table, before in kept:
        table.clear()
        table.update(before)


def exit_code(words):
    try:
        main(words)
    except SystemExit as ended:
        return ended.code or 0
    return 0


@with_blocks("python")
def test_python_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    compare, names = cdpr.compare_reactions, {"__name__": "__main__"}

    def short(*given, **more):
        return compare(*given, **more | {"time": 0.2, "after": 0.2})

    monkeypatch.setattr(cdpr, "compare_reactions", short)
    with only():
        for code in blocks(page, "python"):
            exec(compile(code, str(page), "exec"), names)


@with_blocks("sh")
def test_commands_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    with nullcontext() if page == FIRST else only("replay.html"):
        for code in blocks(page, "sh"):
            for line in code.replace("\\\n", " ").splitlines():
                program, *words = shlex.split(line, comments=True)
                assert program == "cdpr", line
                if words[0] in SHORT and page not in WHOLE:
                    words += SHORT[words[0]]
                assert exit_code(words) == 0, line


def test_blocks_are_of_kinds_that_are_tried():
    kinds = {kind for page in PAGES for kind, _ in BLOCK.findall(page.read_text())}
    assert kinds <= {"python", "sh", "math", "text", "yaml"}


def test_the_menu_names_every_page():
    menu = (ROOT / "mkdocs.yml").read_text()
    for page in PAGES:
        assert str(page.relative_to(DOCS)).replace(os.sep, "/") in menu
