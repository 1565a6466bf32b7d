"""The toy subcommand: what it prints, its help, and its line in the help of `cdpr`."""

import json

import pytest

from cdpr_drake.cli.app import main
from tests.messages import printed


def run(capsys, *arguments):
    """Exit code and stdout of a command."""
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code, printed(capsys).out


def test_what_it_prints(capsys):
    assert run(capsys, "count-cables", "planar") == (0, "4 cables\n")
    code, words = run(capsys, "count-cables", "planar", "--json")
    assert (code, json.loads(words)) == (0, {"cables": 4})


def test_helps(capsys):
    assert "Counts the cables of a robot." in run(capsys, "--help")[1]
    assert "Print the result as JSON." in run(capsys, "count-cables", "--help")[1]


def test_a_robot_that_is_none(capsys):
    assert run(capsys, "count-cables", "no_such_robot")[0] == 2
