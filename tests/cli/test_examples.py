"""The examples run as they are shipped, are listed and copied; each help has two that parse."""

import json
import runpy
import shlex

import pytest
import typer

from cdpr_drake.cli.app import SUBCOMMANDS, main, make_app
from cdpr_drake.cli.command_help import COMMANDS, FIRST_STEPS, groups
from cdpr_drake.cli.examples import EXAMPLES as FOLDER
from cdpr_drake.cli.examples import example_names
from cdpr_drake.systems.controllers.schemes import SCHEMES
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.tensions.methods import METHODS
from tests.messages import printed

LONG = 65
"""Lines that an example has at most, so that it is read in a minute."""

TABLES = (METHODS, SCHEMES, ESTIMATORS)
"""What examples put rows of their own into."""


@pytest.mark.parametrize("name", example_names())
def test_an_example_runs_in_an_empty_folder(name, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    before = [dict(table) for table in TABLES]
    try:
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    finally:
        for table, rows in zip(TABLES, before, strict=True):
            table.clear()
            table.update(rows)
    assert capfd.readouterr().out.strip()
    assert len((FOLDER / f"{name}.py").read_text().splitlines()) <= LONG


def run(capsys, *words):
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return ended.value.code, printed(capsys)


def test_they_are_listed_and_copied_and_nothing_is_overwritten(capsys, tmp_path):
    code, (out, _) = run(capsys, "examples", "--json")
    assert code == 0
    assert [each["name"] for each in json.loads(out)] == example_names()
    code, (out, _) = run(capsys, "examples", "two_robots", "--out", str(tmp_path))
    copied = tmp_path / "two_robots.py"
    assert (code, out.strip()) == (0, str(copied))
    assert copied.read_bytes() == (FOLDER / "two_robots.py").read_bytes()
    copied.write_text("mine")
    code, (_, err) = run(capsys, "examples", "all", "--out", str(tmp_path))
    assert code == 2
    assert "never overwritten" in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["two_robots.py"]
    code, (_, err) = run(capsys, "examples", "--out", str(tmp_path / "new"))
    assert (code, (tmp_path / "new").exists()) == (2, False)
    assert "without an example; accepted: with a name, or all" in err
    code, (_, err) = run(capsys, "examples", "two_robot")
    assert code == 2
    assert "two_robots" in err


def test_groups_and_examples_have_every_subcommand_once():
    named = [name for names in groups().values() for name in names]
    assert list(SUBCOMMANDS) == named == list(COMMANDS)  # groups are not torn apart
    assert len({line for _, *lines in COMMANDS.values() for line in lines}) == 2 * len(named)


@pytest.mark.parametrize("name", list(COMMANDS))
def test_what_a_help_gives_as_example_parses(name):
    command = typer.main.get_command(make_app([name])).commands[name]
    for line in COMMANDS[name][1:]:
        program, asked, *arguments = shlex.split(line)
        assert (program, asked) == ("cdpr", name)
        command.make_context(name, arguments)  # a wrong option or number of arguments raises


def test_the_command_alone_shows_first_steps(capsys):
    code, (out, _) = run(capsys)
    assert code == 0
    for line, words in FIRST_STEPS:
        assert line in out
        assert words in out
        assert line.split()[1] in SUBCOMMANDS
