"""Signals to the program of a process, at moments that `tests.signals` meets by chance."""

import signal
import subprocess
import sys

import pytest

from tests.messages import messages

IMPORTED = """
import os, signal, sys

class Hook:
    def find_spec(self, name, path=None, target=None):
        if name == "cdpr_drake.cli.app":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Hook())
import cdpr_drake.cli
"""

PLANNING = """
import signal, sys
from cdpr_drake.analyses.front import planning as plan; from cdpr_drake.cli.app import main
number = int(sys.argv.pop(1))
plan.plan_along_path = lambda *_: signal.raise_signal(number)
main()
"""

IMPORTING = """
import signal, sys
from cdpr_drake.cli.app import main
name, number = sys.argv.pop(1), int(sys.argv.pop(1))

class Hook:
    def find_spec(self, found, path=None, target=None):
        if found == name:
            sys.meta_path.remove(self)
            signal.raise_signal(number)

sys.meta_path.insert(0, Hook())
main()
"""

WRAPPED = """
import builtins, sys
from cdpr_drake.analyses.front import planning as plan; from cdpr_drake.cli.app import main
kind = getattr(builtins, sys.argv.pop(1))

def wraps(*_):
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as problem:
        raise kind("initialization failed") from problem

plan.plan_along_path = wraps
main()
"""

MAKING = """
import signal, sys
from cdpr_drake.analyses.front import planning as plan; from cdpr_drake.cli.app import main
number = int(sys.argv.pop(1))

class Late:
    def __set_name__(self, owner, name):
        signal.raise_signal(number)

plan.plan_along_path = lambda *_: type("Made", (), {"late": Late()})
main()
"""

OVER = """
import atexit, os, signal, sys
atexit.register(os.kill, os.getpid(), signal.SIGINT)
from cdpr_drake.cli.app import main
main()
"""


def ended(program, *arguments, folder):
    """Exit code of a program, negative for a signal, and what it said on stderr."""
    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, messages(done.stderr)


def test_ctrl_c_while_the_command_is_imported_says_nothing(tmp_path):
    assert ended(IMPORTED, folder=tmp_path) == (-signal.SIGINT, "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", ["numpy", "pydrake.common", "pydrake.common.deprecation"])
def test_a_signal_while_a_subcommand_is_imported_leaves_no_traceback(tmp_path, name, number):
    """The last one is imported by Drake's compiled code, which hides what is raised there."""
    found = ended(IMPORTING, name, int(number), "schema", "robot", folder=tmp_path)
    assert found == (130, "cdpr: stopped\n")


@pytest.mark.parametrize("kind", ["ImportError", "RuntimeError"])
def test_what_wraps_a_ctrl_c_counts_as_one(tmp_path, kind):
    """As Drake's compiled modules do, and Python where a class is just made."""
    words = ["plan", "acrobot_large", "--waypoints", "0,0,0.2; 0.1,-0.1,0.3", "--limits", "1,60"]
    assert ended(WRAPPED, kind, *words, folder=tmp_path) == (130, "cdpr: stopped\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_class_is_made_leaves_no_traceback(tmp_path, number):
    """Python makes a RuntimeError of it: Error calling __set_name__."""
    words = ["plan", "acrobot_large", "--waypoints", "0,0,0.2; 0.1,-0.1,0.3", "--limits", "1,60"]
    assert ended(MAKING, int(number), *words, folder=tmp_path) == (130, "cdpr: stopped\n")


def test_ctrl_c_when_all_is_done_says_nothing(tmp_path):
    assert ended(OVER, "--version", folder=tmp_path) == (-signal.SIGINT, "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_command_that_keeps_nothing_leaves_nothing(tmp_path, number):
    words = ["plan", "acrobot_large", "--waypoints", "0,0,0.2; 0.1,-0.1,0.3", "--limits", "1,60"]
    words += ["--out", "out"]
    code, said = ended(PLANNING, int(number), *words, folder=tmp_path)
    assert code == 130, said
    assert said.splitlines()[-1] == "cdpr: stopped"
    assert list(tmp_path.iterdir()) == []
