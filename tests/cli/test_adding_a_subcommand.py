"""A subcommand is a file and a row of the table."""

import pytest

from cdpr_drake.cli.app import SUBCOMMANDS, main
from tests.messages import printed

GREET = '''
from typing import Annotated

import typer

from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import print_json


def greet_all(
    name: Annotated[str, typer.Argument(help="Who.")], as_json: AsJson = False
) -> int:
    """Greets."""
    print_json({"hello": name}) if as_json else print(f"Hello {name}")
    return 3
'''


@pytest.fixture
def _greet(tmp_path, monkeypatch):
    (tmp_path / "toy_subcommand.py").write_text(GREET)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(SUBCOMMANDS, "greet-all", "toy_subcommand")


def run(capsys, *arguments):
    """Exit code and stdout of a command."""
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code, printed(capsys).out


@pytest.mark.usefixtures("_greet")
def test_a_row_of_the_table_is_a_subcommand(capsys):
    assert run(capsys, "greet-all", "you") == (3, "Hello you\n")
    assert run(capsys, "greet-all", "you", "--json") == (3, '{\n  "hello": "you"\n}\n')
    assert "Greets." in run(capsys, "--help")[1]
    assert "Print JSON." in run(capsys, "greet-all", "--help")[1]


def test_without_the_row_there_is_none(capsys):
    assert run(capsys, "greet-all", "you")[0] == 2
