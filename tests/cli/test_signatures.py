"""Whatever a verb declares is refused in a line that names the option, for all commands alike."""

import inspect
from pkgutil import resolve_name

import pytest

from cdpr_drake.cli.call import options_of, parsed, shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from tests.cli.commands import refuse

pytestmark = pytest.mark.usefixtures("here")

ARGUMENTS = {name: shown_arguments(name) for name in COMMANDS}


def is_option(argument):
    """True if it is written with dashes."""
    return argument.name.startswith("--")


def kinds(argument):
    """Types of an argument without None."""
    parts = getattr(argument.hint, "__args__", (argument.hint,))
    return [part for part in parts if part is not type(None)]


OPTIONS = [
    (name, argument.name)
    for name, arguments in ARGUMENTS.items() for argument in arguments if is_option(argument)
]  # fmt: skip
PARSED = [
    (name, argument.name) for name, arguments in ARGUMENTS.items() for argument in arguments
    if is_option(argument) and kinds(argument) in ([int], [float])
]  # fmt: skip
CHOSEN = [
    (name, argument) for name, arguments in ARGUMENTS.items() for argument in arguments
    if argument.get_choices()
]  # fmt: skip
NUMBERS = [
    (name, argument.name) for name, arguments in ARGUMENTS.items() for argument in arguments
    if is_option(argument) and kinds(argument)[0] is float
]  # fmt: skip


NEEDED = {"--squares": "2x2", "--poses": "0,0,1"}
"""Words of options that take no number."""


def needed(name, *but):
    """A word for each argument that has to be there."""
    words = []
    for argument in ARGUMENTS[name]:
        if argument.required and argument.name not in but:
            choices = argument.get_choices()
            value = choices[0] if choices else NEEDED.get(argument.name, "1")
            words += [f"{argument.name}={value}"] if is_option(argument) else [value]
    return words


@pytest.mark.parametrize("name", COMMANDS)
def test_the_first_line_is_that_of_the_docstring(name):
    words = " ".join((resolve_name(COMMANDS[name].verb).__doc__ or "").split())
    assert words.startswith(COMMANDS[name].line)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_argument_has_words_and_a_verb_names_no_option(name):
    verb = resolve_name(COMMANDS[name].verb)
    for argument in ARGUMENTS[name]:
        assert argument.parameter.help, argument.name
    if COMMANDS[name].verb.startswith("cdpr_drake.analyses"):
        code = inspect.getsource(verb).rpartition('"""')[2]
        assert [option for option in options_of(verb).values() if f'"{option}"' in code] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_words_that_are_needed_are_enough_and_none_is_too_many(name, capsys):
    assert parsed([name, *needed(name)])
    for argument in ARGUMENTS[name]:
        if argument.required and is_option(argument):
            said = refuse(capsys, name, *needed(name, argument.name))
            assert argument.name in said or argument.name.lstrip("-").upper() in said
    assert "--no-such-option" in refuse(capsys, name, *needed(name), "--no-such-option")


@pytest.mark.parametrize(("name", "option"), PARSED)
def test_what_is_no_number_is_named(name, option, capsys):
    said = refuse(capsys, name, *needed(name, option), f"{option}=many")
    assert f"{option}: found 'many'; accepted: " in said


@pytest.mark.parametrize(("name", "option"), NUMBERS)
@pytest.mark.parametrize("word", ["nan", "1e999"])
def test_numbers_are_finite(name, option, word, capsys):
    said = refuse(capsys, name, *needed(name, option), f"{option}={word}")
    assert said.startswith(f"cdpr: {option}: found ")


@pytest.mark.parametrize(("name", "argument"), CHOSEN, ids=str)
def test_a_choice_lists_what_is_accepted(name, argument, capsys):
    word = f"{argument.name}=" * is_option(argument) + argument.get_choices()[-1] + "x"
    said = refuse(capsys, name, word, *needed(name, argument.name))
    assert f"{argument.name}: found" in said
    assert f"did you mean {argument.get_choices()[-1]}" in said
