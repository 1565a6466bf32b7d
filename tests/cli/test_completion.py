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
    words = line.split(" ")
    asked = {"_CDPR_COMPLETE": f"complete_{shell}"}
    if shell == "bash":
        asked |= {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    else:
        asked |= {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    return asked


def offered(line, shell="bash"):
    """What the shell is offered, and what was imported for it."""
    done = subprocess.run(
        [sys.executable, "-c", WORDS],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **asking(line, shell)},
    )
    out, _, imported = done.stdout.rpartition("imported: ")
    return out.split(), imported.strip()


def test_subcommands():
    words, imported = offered("cdpr s")
    assert words == [name for name in SUBCOMMANDS if name.startswith("s")]
    assert imported == "[]"


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("cdpr simulate acrobot_c", ["acrobot_circles", "acrobot_circling_ring",
                                     "acrobot_computed_torque"]),
        ("cdpr tension ", sorted([*robot_names(), *mechanism_names()])),
        ("cdpr view caroca_", ["caroca_gazebo"]),
    ],
)  # fmt: skip
def test_names_are_offered_without_drake(line, names):
    words, imported = offered(line)
    assert words == names
    assert imported == "[]"


def test_names_in_other_shells():
    for shell in ("zsh", "fish"):
        words, imported = offered("cdpr view plan", shell)
        assert any("planar" in word for word in words)
        assert imported == "[]"


def test_options_and_their_values(capsys, monkeypatch):
    def offered_here(line):
        for name, value in asking(line).items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(sys, "argv", ["cdpr"])
        with pytest.raises(SystemExit):
            main()
        return printed(capsys).out.split()

    assert set(offered_here("cdpr simulate acrobot_pbvs --s")) == {
        "--scheduler",
        "--seed",
        "--seeds",
        "--set",
    }
    assert offered_here("cdpr tension planar --method bary") == ["barycenter"]
    assert offered_here("cdpr study case-")[0] == "case-1"


def test_names_are_those_that_the_loaders_know():
    assert robot_words("") == list(robot_names())
    assert scenario_words("") == list(scenario_names())


def test_a_quote_that_is_open_breaks_nothing(monkeypatch):
    monkeypatch.setenv("_CDPR_COMPLETE", "complete_zsh")
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "cdpr simulate 'acro")
    assert asked_words() == ["simulate", "'acro"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_for_a_shell_is_shown(shell):
    done = subprocess.run(
        [sys.executable, "-m", "cdpr_drake", "--show-completion", shell],
        capture_output=True,
        text=True,
        check=True,
        # Else typer asks which shell has started this, and there may be none.
        env={**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )
    assert "_CDPR_COMPLETE" in done.stdout
