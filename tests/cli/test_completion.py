"""The Tab key: subcommands and names at once, options of the one that is asked for."""

import os
import subprocess
import sys

import pytest

from cdpr_drake.cli.app import SUBCOMMANDS, main
from cdpr_drake.cli.completion import asked_words, robot_words, scenario_words
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.cli.commands import run
from tests.messages import printed

WORDS = """
import sys
from cdpr_drake.cli.app import main
try:
    main()
except SystemExit:
    print("imported:", [name for name in ("pydrake", "numba", "numpy") if name in sys.modules])
"""


def asking(line, shell="bash"):
    """Environment in which the command says what it offers for a line, the cursor at its end."""
    asked = {"_CDPR_COMPLETE": f"complete_{shell}"}
    if shell == "bash":
        return asked | {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    return asked | {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"}


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("cdpr s", [name for name in SUBCOMMANDS if name.startswith("s")]),
        ("cdpr simulate acrobot_c", ["acrobot_circles", "acrobot_circling_ring",
                                     "acrobot_computed_torque"]),
        ("cdpr equilibria ", list(robot_names())),
        ("cdpr tension ", sorted(robot_names() + mechanism_names())),
        ("cdpr view caroca_", ["caroca_gazebo"]),
        ("zsh: cdpr view plan", ["planar"]),
        ("fish: cdpr view plan", ["planar"]),
    ],
)  # fmt: skip
def test_names_are_offered_without_drake(line, names):
    shell, _, asked = line.rpartition(": ")
    program = [sys.executable, "-c", WORDS]
    there = {**os.environ, **asking(asked, shell or "bash")}
    out = subprocess.check_output(program, text=True, env=there)
    words, _, imported = out.rpartition("imported: ")
    assert imported == "[]\n"
    if shell:  # these have a description of each beside it
        assert any(name in word for name in names for word in words.split())
    else:
        assert words.split() == names


def test_options_and_their_values(capsys, monkeypatch):
    def offered(line):
        for name, value in asking(line).items():
            monkeypatch.setenv(name, value)
        with pytest.raises(SystemExit):
            main([])
        return printed(capsys).out.split()

    options = ["--scheduler", "--seed", "--seeds", "--set"]
    assert sorted(offered("cdpr simulate acrobot_pbvs --s")) == options
    assert offered("cdpr tension planar --method bary") == ["barycenter"]
    assert offered("cdpr study case-")[0] == "case-1"


def test_names_are_those_that_the_loaders_know():
    assert robot_words("") == list(robot_names())
    assert scenario_words("") == list(scenario_names())


def test_a_quote_that_is_open_breaks_nothing(monkeypatch):
    monkeypatch.setenv("_CDPR_COMPLETE", "complete_zsh")
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "cdpr simulate 'acro")
    assert asked_words() == ["simulate", "'acro"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_for_a_shell_is_shown(shell, monkeypatch, capsys):
    # Else typer asks which shell has started this, and there may be none.
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    code, out, _ = run(capsys, "--show-completion", shell)
    assert (code, "_CDPR_COMPLETE" in out) == (0, True)
