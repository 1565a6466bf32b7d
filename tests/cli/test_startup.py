"""Questions that need no robot import none of what robots need."""

import errno
import os
import subprocess
import sys

import pytest

from cdpr_drake.cli.app import SUBCOMMANDS, _first_line, main
from tests.messages import messages, printed

WORDS = """
import sys
from cdpr_drake.cli.app import main
try:
    main({arguments!r})
except SystemExit:
    pass
heavy = ("pydrake", "numba", "matplotlib", "cv2", "scipy", "distributed", "numpy", "rich")
print("own:", len([name for name in sys.modules if name.startswith("cdpr_drake")]))
print("imported:", [name for name in heavy if name in sys.modules], len(sys.modules))
"""

MOST_MODULES = 400
"""Modules of Python and typer; with rich there are twice as many, with Drake above two thousand."""


MOST_OF_OUR_OWN = 95
"""Modules of this package that `cdpr tension` imports, rooms included: methods, robots, geometry.
Readers of other tools, cameras, mechanisms and equilibria are not among them."""


def imported(*arguments):
    words = WORDS.format(arguments=list(arguments))
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    rest, _, last = done.stdout.rpartition("imported: ")
    names, _, count = last.rpartition(" ")
    return names, int(count), int(rest.rpartition("own: ")[2])


@pytest.mark.parametrize("arguments", [(), ("--help",), ("--version",)])
def test_help_imports_nothing_heavy(arguments):
    names, count, _ = imported(*arguments)
    assert names == "[]"
    assert count < MOST_MODULES


def test_the_help_has_the_whole_first_line_of_each_subcommand():
    words = [sys.executable, "-m", "cdpr_drake", "--help"]
    narrow = {**os.environ, "COLUMNS": "60"}
    help_text = " ".join(subprocess.check_output(words, text=True, env=narrow).split())
    for name, where in SUBCOMMANDS.items():
        assert f" {name} {_first_line(name, where)}".replace("\n", " ") in help_text


def test_a_question_about_tensions_draws_nothing():
    names, _, own = imported("tension", "acrobot_small", "--pose", "0,0,0.3")
    assert "matplotlib" not in names
    assert own <= MOST_OF_OUR_OWN


def test_garbage_is_searched_for_but_not_among_what_was_imported():
    """Two hundred thousand objects stay; a search through them takes a tenth of a second."""
    words = """
import gc, sys
import cdpr_drake.cli.app as app
def seen(*arguments, **options):
    print("searches:", gc.isenabled(), "left alone:", gc.get_freeze_count() > 100_000)
app.typer.Typer.__call__ = seen
sys.argv = ["cdpr", "tension", "planar"]
app.main()
"""
    command = [sys.executable, "-c", words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "searches: True left alone: True\n"


WORKSPACE = """
import sys
import cdpr_drake.analyses.workspaces.workspace_scene
import cdpr_drake.cli.workspace
print([name for name in sys.modules if name.endswith("visual_servo_scenario")])
"""


def test_a_workspace_is_drawn_without_what_servos_are_made_of():
    command = [sys.executable, "-c", WORKSPACE]
    assert subprocess.check_output(command, text=True) == "[]\n"


def test_a_locale_without_utf_8_is_said_in_one_line():
    """Drake cannot start there; that once was a traceback."""
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    words = [sys.executable, "-m", "cdpr_drake", "robots"]
    done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, **plain})
    assert done.returncode == 2
    assert len(messages(done.stderr).splitlines()) == 1
    assert "accepted: one with UTF-8" in done.stderr


def test_what_the_system_refuses_is_one_line(capsys, monkeypatch):
    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device", "log.npz")

    monkeypatch.setattr("cdpr_drake.cli.robots.load_robot", full)
    with pytest.raises(SystemExit) as ended:
        main(["robots"])
    assert ended.value.code == 2
    assert printed(capsys).err == "cdpr: log.npz: No space left on device\n"


def test_drake_is_silent_although_it_is_imported_late(tmp_path):
    command = [sys.executable, "-m", "cdpr_drake", "view", "planar", "--html", "robot.html"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == "robot.html\n"
    assert not messages(done.stderr)
