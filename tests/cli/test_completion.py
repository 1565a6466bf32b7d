"""The Tab key: subcommands, options and choices from a script, names of files from the command."""

import pytest

from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.cli.commands import run


@pytest.mark.parametrize(
    ("line", "names"),
    [
        (("export", "acrobot_c"), sorted(robot_names() + mechanism_names())),
        (("import-log", "log.csv", "--robot", ""), robot_names()),
        (("simulate", "acrobot_c"), scenario_names()),
        (("tension", ""), sorted(robot_names() + mechanism_names())),
        (("studio", ""), robot_names() + scenario_names()),
    ],
)
def test_names_are_those_that_the_loaders_know(line, names, capsys):
    code, out, _ = run(capsys, "__complete", *line)
    assert (code, out.split()[1:]) == (0, list(names))  # the first line is a mark


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_for_a_shell_has_commands_options_and_choices(shell, capsys, tmp_path):
    script = tmp_path / "script"
    code, _, _ = run(capsys, "completion", "--shell", shell, "--output", script)
    words = script.read_text()
    assert code == 0
    assert all(name in words for name in COMMANDS)
    for word in ("log-rate", "worked-examples", "barycenter", "__complete"):
        assert word in words
