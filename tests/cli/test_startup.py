"""What a command imports before it answers, and how it refuses where it cannot start."""

import ast
import os
import subprocess
import sys

import pytest

from cdpr_drake.cli.commands import COMMANDS
from tests.messages import messages

WORDS = """
import sys
from cdpr_drake.cli.app import main
try:
    main({arguments!r})
except SystemExit:
    pass
heavy = ("pydrake", "numba", "matplotlib", "cv2", "scipy", "distributed", "numpy", "rich")
print("\\n", [name for name in heavy if name in sys.modules], ",", len(sys.modules))
"""

MOST_MODULES = 200
"""Modules of Python; with cyclopts and rich there are thrice as many, with Drake two thousand."""

MOST_OF_OUR_OWN = 95
"""Modules of this package that `cdpr tension` imports, rooms included: methods, robots, geometry.
Readers of other tools, cameras, mechanisms and equilibria are not among them."""


def said(program, *words, **options):
    """What a Python program prints, and says on stderr."""
    command = [sys.executable, "-c", program, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True, **options)
    return done.stdout, messages(done.stderr)


@pytest.mark.parametrize("arguments", [(), ("--help",), ("--version",)])
def test_help_imports_nothing_heavy(arguments):
    out, _ = said(WORDS.format(arguments=list(arguments)))
    names, count = ast.literal_eval(out.splitlines()[-1].strip())
    assert names == []
    assert count < MOST_MODULES


def test_the_help_has_the_whole_first_line_of_each_subcommand():
    words = [sys.executable, "-m", "cdpr_drake", "--help"]
    narrow = {**os.environ, "COLUMNS": "60"}
    help_text = " ".join(subprocess.check_output(words, text=True, env=narrow).split())
    for name, command in COMMANDS.items():
        assert f" {name} {command.line}" in help_text


PROGRAM = """
import gc, sys
import cdpr_drake.cli.app as app

def end(words):
    sys.argv = ["cdpr", *words]
    try:
        app.main()
    except SystemExit as end:
        assert not end.code

found = {}
end(["tension", "acrobot_small", "--pose", "0,0,0.3"])
found["tension"] = {
    "figures": "matplotlib" in sys.modules,
    "own": sum(name.startswith("cdpr_drake") for name in sys.modules),
}
import cdpr_drake.analyses.workspaces.workspace_scene
import cdpr_drake.analyses.workspaces.workspace
found["servos"] = [name for name in sys.modules if name.endswith("visual_servo_scenario")]
end(["view", "planar", "--html", "robot.html"])
import cdpr_drake.cli.call as call
show = call._show

def seen(*arguments):
    found["searches"] = gc.isenabled(), gc.get_freeze_count() > 100_000
    return show(*arguments)

call._show = seen
end(["schema", "robot", "--json"])
print(found)
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Of one process: what it imported, the lines that it printed, and its stderr."""
    out, err = said(PROGRAM, cwd=tmp_path_factory.mktemp("there"))
    *lines, found = out.splitlines()
    return ast.literal_eval(found), lines, err


def test_a_question_about_tensions_draws_nothing(program):
    tension = program[0]["tension"]
    assert not tension["figures"]
    assert tension["own"] <= MOST_OF_OUR_OWN


def test_a_workspace_is_drawn_without_what_servos_are_made_of(program):
    assert program[0]["servos"] == []


def test_garbage_is_searched_for_but_not_among_what_was_imported(program):
    """Two hundred thousand objects stay; a search through them takes a tenth of a second."""
    assert program[0]["searches"] == (True, True)


def test_drake_is_silent_although_it_is_imported_late(program):
    _, lines, err = program
    assert "robot.html" in lines
    assert not err


def test_a_locale_without_utf_8_is_said_in_one_line():
    """Drake cannot start there; that once was a traceback."""
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    words = [sys.executable, "-m", "cdpr_drake", "robots"]
    done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, **plain})
    assert done.returncode == 2
    assert len(messages(done.stderr).splitlines()) == 1
    assert "accepted: one with UTF-8" in done.stderr
