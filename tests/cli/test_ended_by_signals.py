"""Signals to the program of a process, at moments that `tests.signals` meets by chance."""

import gc
import signal
import subprocess
import sys

import pytest

from cdpr_drake.analyses import tensions
from cdpr_drake.cli.app import main
from tests.messages import messages, printed

IMPORTED = """
import os, signal, sys

class Hook:
    def find_spec(self, name, path=None, target=None):
        if name == "cdpr_drake.cli.app":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Hook())
import cdpr_drake.cli
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

OVER = """
import atexit, os, signal, sys
atexit.register(os.kill, os.getpid(), signal.SIGINT)
from cdpr_drake.cli.app import main
main()
"""

STOPPED = (130, "cdpr: stopped\n")
NUMBERS = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])


def ended(program, *arguments):
    """Exit code of a program, negative for a signal, and what it said on stderr."""
    words = [sys.executable, "-c", program, *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.returncode, messages(done.stderr)


def test_ctrl_c_while_the_command_is_imported_says_nothing(here):
    assert ended(IMPORTED) == (-signal.SIGINT, "")


@pytest.mark.parametrize(
    ("name", "number"),
    [("numpy", signal.SIGTERM), ("pydrake.common", signal.SIGINT),
     ("pydrake.common.deprecation", signal.SIGTERM)],
)  # fmt: skip
def test_a_signal_while_a_subcommand_is_imported_leaves_no_traceback(here, name, number):
    """The last one is imported by Drake's compiled code, which hides what is raised there."""
    assert ended(IMPORTING, name, int(number), "schema", "robot") == STOPPED


def test_ctrl_c_when_all_is_done_says_nothing(here):
    assert ended(OVER, "--version") == (-signal.SIGINT, "")


@pytest.fixture
def tension(here, monkeypatch, capsys):
    """Calls the program of the process, here, with something else in the place of a problem."""
    handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}

    def call(instead):
        monkeypatch.setattr(tensions, "wrench_balance", instead)
        monkeypatch.setattr(sys, "argv", ["cdpr", "tension", "acrobot_large"])
        with pytest.raises(SystemExit) as end:
            main()
        assert not any(here.iterdir())
        return end.value.code, printed(capsys).err

    yield call
    for each, handler in handlers.items():
        signal.signal(each, handler)
    gc.enable()


@pytest.mark.parametrize("kind", [ImportError, RuntimeError, SystemError, KeyError, TypeError])
def test_what_wraps_a_ctrl_c_counts_as_one(tension, kind):
    """As compilers and Drake's compiled modules do, and Python where a class is just made."""

    def wraps(*_, **__):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as problem:
            raise kind("initialization failed") from problem

    assert tension(wraps) == STOPPED


@NUMBERS
def test_a_signal_while_a_class_is_made_leaves_no_traceback(tension, number):
    """Python makes a RuntimeError of it: Error calling __set_name__."""

    class Late:
        def __set_name__(self, owner, name):
            signal.raise_signal(number)

    assert tension(lambda *_, **__: type("Made", (), {"late": Late()})) == STOPPED


@NUMBERS
def test_a_command_that_keeps_nothing_leaves_nothing(tension, number):
    code, said = tension(lambda *_, **__: signal.raise_signal(number))
    assert (code, said.splitlines()[-1]) == (130, "cdpr: stopped")
