"""Whatever a verb declares is refused in a line that names the option, for all commands alike."""

import ast
import inspect
import re
from pathlib import Path
from pkgutil import resolve_name

import pytest

from cdpr_drake.cli.call import _converted, options_of, parsed, shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from tests.cli.commands import refuse

pytestmark = pytest.mark.usefixtures("here")

ARGUMENTS = {name: shown_arguments(name) for name in COMMANDS}


def is_option(argument):
    """True if it is written with dashes."""
    return argument.name.startswith("--")


def is_either(parameter):
    """True if it is written with dashes or in its place."""
    return not parameter.is_positional_only and not parameter.is_keyword_only


def kinds(argument):
    """Types of an argument without None."""
    parts = getattr(argument.hint, "__args__", (argument.hint,))
    return [part for part in parts if part is not type(None)]


OPTIONS = [
    (name, argument.name)
    for name, arguments in ARGUMENTS.items() for argument in arguments if is_option(argument)
]  # fmt: skip
ANY_WORD = {
    "--bounds", "--cables", "--common", "--folder", "--free", "--gallery", "--goal", "--held",
    "--host", "--html", "--kind", "--log", "--mapping", "--measure", "--obstacles", "--only",
    "--out", "--parameters", "--path", "--picture", "--poses-from", "--rails", "--reactions",
    "--resist", "--robot", "--runs-from", "--scenario", "--set", "--tags", "--taut",
    "--unknown", "--validate", "--workers", "--wrench-set",
}  # fmt: skip
"""Options that take names or paths: what those are is known later."""

PARSED = [
    (name, argument.name) for name, arguments in ARGUMENTS.items() for argument in arguments
    if is_option(argument) and argument.name not in ANY_WORD
    and (kinds(argument) in ([int], [float]) or argument.parameter.converter is not _converted)
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
def test_first_line_and_arguments_have_words_and_a_verb_names_no_option(name):
    verb = resolve_name(COMMANDS[name].verb)
    assert " ".join((verb.__doc__ or "").split()).startswith(COMMANDS[name].line)
    for argument in ARGUMENTS[name]:
        assert argument.parameter.help, argument.name
    if COMMANDS[name].verb.startswith("cdpr_drake.analyses"):
        code = inspect.getsource(verb).rpartition('"""')[2]
        assert [option for option in options_of(verb).values() if f'"{option}"' in code] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_what_has_a_default_is_an_option_but_for_the_first(name):
    either = [argument for argument in ARGUMENTS[name] if is_either(argument.field_info)]
    assert [argument.name for argument in either[1:] if not argument.required] == []


VERBS = [
    (verb, name) for name, command in COMMANDS.items()
    for verb in (command.verb, *(verb for verb, _ in command.forms.values()))
    if verb.startswith("cdpr_drake.analyses")
]  # fmt: skip


@pytest.mark.parametrize(("verb", "name"), VERBS)
def test_a_docstring_has_a_line_for_each_argument(verb, name):
    function = resolve_name(verb)
    missing = [
        argument for argument in inspect.signature(function).parameters
        if not re.search(rf"^ +{argument}: ", function.__doc__ or "", re.MULTILINE)
    ]  # fmt: skip
    assert missing == []


SETTINGS = ("CalibrationTask", "DesignSettings", "ProofSettings")
"""Public classes: a log and its unknowns, which trials of signs and of rows change; the schema of a
file; what `ProvenSets` are made with."""

CARRIED = 5
"""So many fields of a class may have the name of an option by chance."""

TYPES = ("Parameter", "words", "one_of", "_names", "whole", "named_values")
"""What makes types of arguments, which may name options."""


def room_of(verb):
    """Sources of a verb's module, or of its folder if that is a room of its own."""
    path = Path(inspect.getfile(inspect.unwrap(resolve_name(verb))))
    return [path] if path.parent.name == "analyses" else sorted(path.parent.glob("*.py"))


@pytest.mark.parametrize(("verb", "name"), VERBS)
def test_an_option_stands_in_its_signature_and_docstring_only(verb, name):
    options = options_of(resolve_name(verb))
    for path in room_of(verb):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        types = [
            part for call in ast.walk(tree)
            if isinstance(call, ast.Call) and getattr(call.func, "id", "") in TYPES
            for part in ast.walk(call)
        ]  # fmt: skip
        docstrings = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
        allowed = {id(node) for node in (*types, *docstrings)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = re.sub("cdpr [a-z-]+ --[a-z-]+", "", node.value)  # a whole command
                named = set(options.values()) & set(re.findall("--[a-z-]+", text))
                assert id(node) in allowed or not named, f"{path.name}:{node.lineno}: {named}"
            if isinstance(node, ast.ClassDef) and node.name not in SETTINGS:
                fields = [part.target.id for part in node.body if isinstance(part, ast.AnnAssign)]
                assert len(options.keys() & set(fields)) <= CARRIED, f"{path.name}: {node.name}"


@pytest.mark.parametrize("name", COMMANDS)
def test_words_that_are_needed_are_enough_and_none_is_too_many(name, capsys):
    assert parsed([name, *needed(name)])
    for argument in ARGUMENTS[name]:
        if argument.required and is_option(argument):
            said = refuse(capsys, name, *needed(name, argument.name))
            assert argument.name in said or argument.name.lstrip("-").upper() in said
    assert "--no-such-option" in refuse(capsys, name, *needed(name), "--no-such-option")


@pytest.mark.parametrize(("name", "option"), PARSED)
def test_what_is_no_value_is_named(name, option, capsys):
    said = refuse(capsys, name, *needed(name, option), f"{option}=?,;:=")
    assert re.search(rf"{option}: found '\?(,;:=)?'; accepted: ", said)


@pytest.mark.parametrize(("number", "name", "option"), [(k, *row) for k, row in enumerate(NUMBERS)])
def test_numbers_are_finite(number, name, option, capsys):
    word = ("nan", "1e999", "-inf")[number % 3]
    said = refuse(capsys, name, *needed(name, option), f"{option}={word}")
    assert said.startswith(f"cdpr: {option}: found ")


@pytest.mark.parametrize(
    ("name", "argument"), CHOSEN, ids=[f"{name} {argument.name}" for name, argument in CHOSEN]
)
def test_a_choice_lists_what_is_accepted(name, argument, capsys):
    word = f"{argument.name}=" * is_option(argument) + argument.get_choices()[-1] + "x"
    said = refuse(capsys, name, word, *needed(name, argument.name))
    assert f"{argument.name}: found" in said
    assert f"did you mean {argument.get_choices()[-1]}" in said
