"""One call of a subcommand: its words become arguments of a verb, and its result is shown.

What a subcommand accepts stands in the signature and the docstring of its verb, see `COMMANDS`.
"""

from __future__ import annotations

import inspect
import json as js
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from functools import wraps
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any, NamedTuple, get_args

from cyclopts import (
    App,
    Argument,
    CoercionError,
    CycloptsError,
    Group,
    MissingArgumentError,
    Parameter,
    UnknownOptionError,
    UnusedCliTokensError,
    convert,
)

from cdpr_drake.cli.commands import COMMANDS, Command
from cdpr_drake.cli.option_names import COMMAND_WORDS, named_options, with_options
from cdpr_drake.cli.process import INCOMPLETE
from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.schema.input_files import inputs_read_once

LIVING = "studio"
"""The subcommand that goes on while files change; any other reads each file once."""

PICTURES = ("png", "pdf", "svg", "jpg", "jpeg", "tif", "tiff", "webp", "eps", "ps", "pgf")
"""Endings of files of --plot."""

KINDS = {int: "a whole number", float: "a number", bool: "true or false"}
"""What words of an option have to be, by the type of its argument."""

COMPLETION = "completion"
"""The subcommand that lets the Tab key complete."""

COMPLETE = "__complete"
"""The subcommand that scripts of shells call for names."""

SHARED = Group("Of all commands", sort_key=100)


def make_app(command_line: Sequence[str]) -> App:
    """The command. Of subcommands that are not asked for, the help has the first line only."""
    command_name = next((word for word in command_line if not word.startswith("-")), "")
    app = App(
        name="cdpr", help="Cable-driven parallel robots in Drake.", version_flags=(),
        help_format="markdown", help_flags=("--help",),
        default_parameter=_usual_parameter(),
    )  # fmt: skip
    for name, command in COMMANDS.items():
        verb: Any = _verb_of(command, command_line)
        words = {"help": command.line}
        if name == command_name:
            verb, words = _with_options(resolve_name(verb)), {}
        examples = "\n\n".join(("Examples:", *(f"`{line}`" for line in command.examples)))
        for option, (_, line) in command.forms.items():
            examples += f"\n\n`cdpr {name} --{option} --help`: {line}"
        app.command(verb, name=name, help_epilogue=examples, **words)
    app.register_install_completion_command(name=COMPLETION)
    return app


def _signature(verb: Callable[..., Any]) -> inspect.Signature:
    """That of a verb on a command line: what has a default is an option, but for the first."""
    parameters = list(inspect.signature(verb, eval_str=True).parameters.values())
    for place, parameter in enumerate(parameters):
        either = parameter.kind is parameter.POSITIONAL_OR_KEYWORD
        if place > 0 and either and parameter.default is not parameter.empty:
            parameters[place] = parameter.replace(kind=parameter.KEYWORD_ONLY)
    return inspect.Signature(parameters)


def _with_options(verb: Callable[..., Any]) -> Callable[..., Any]:
    """A verb with its signature on a command line."""

    @wraps(verb)
    def with_options(*arguments: Any, **options: Any) -> Any:
        return verb(*arguments, **options)

    with_options.__signature__ = _signature(verb)  # type: ignore[attr-defined]
    return with_options


def _verb_of(command: Command, command_line: Sequence[str]) -> str:
    """Module and function that answer a command line.

    Raises:
        CdprError: It has options of two forms of the command.
    """
    options = [f"--{form}" for form in _forms_in(command, command_line)]
    if len(options) > 1:
        raise CdprError(f"{options[0]}: found with {options[1]}; accepted: one of them")
    return command.forms[options[0][2:]][0] if options else command.verb


def _forms_in(command: Command, command_line: Sequence[str]) -> list[str]:
    words = {word.partition("=")[0].removeprefix("--") for word in command_line if word[:2] == "--"}
    return [form for form in command.forms if form in words]


def _usual_parameter() -> Parameter:
    return Parameter(
        negative_iterable=(), negative_none=(), allow_repeating=True, converter=_converted,
        show_default=_default_words,
    )  # fmt: skip


def _converted(kind: Any, tokens: Any) -> Any:
    """A value of a type; whole numbers have no fraction, which cyclopts would round."""
    kinds = [part for part in get_args(kind) if part is not type(None)] or [kind]
    return int(tokens[-1].value) if kinds[0] is int else convert(kind, tokens)


def shown_arguments(name: str, *form: str) -> list[Argument]:
    """Arguments and options that the help of a subcommand shows, with their words.

    Args:
        name: The subcommand.
        form: The option of one of its forms, such as --free.
    """
    arguments = make_app([name, *form])[name].assemble_argument_collection(
        default_parameter=_usual_parameter(), parse_docstring=True
    )
    return [argument for argument in arguments if argument.show]


def _default_words(value: object) -> str | None:
    """A default as one would write it on a command line; None where nobody has to know it."""
    if isinstance(value, tuple | list):
        value = ",".join(map(str, value))
    return None if value in (None, False, "") else str(value)


def _joined(command_line: Sequence[str]) -> list[str]:
    """Words of a command line in which a negative number belongs to the option before it."""
    words: list[str] = []
    for word in command_line:
        if re.match(r"-([\d.]|$)", word) and words and re.fullmatch(r"--[a-z-]+", words[-1]):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


class Call(NamedTuple):
    """A command line that was read.

    Attributes:
        name: The subcommand.
        verb: The function that answers it.
        bound: Arguments for the verb.
        long: True if the verb tells how far it is, and stops when it is asked to.
        options: Options by the names of the verb's arguments, for messages.
        json: True if the result is printed as JSON.
        figures: Files by the names of figures; empty: the first.
    """

    name: str
    verb: Callable[..., Any]
    bound: inspect.BoundArguments
    long: bool
    options: Mapping[str, str]
    json: bool
    figures: Mapping[str, Path]


def parsed(command_line: Sequence[str]) -> Call | None:
    """Reads a command line; None if that was a question for help or completion, now answered.

    Raises:
        CdprError: Words are not accepted; options are named as they are written.
    """
    name = next((word for word in command_line if not word.startswith("-")), "")
    if name == COMPLETE:
        make_app(command_line[1:])(command_line, result_action="return_value")
        return None
    if name not in (*COMMANDS, COMPLETION):
        words = f"found {name!r}; {accepted_names(name, COMMANDS)}" if name else "found none"
        raise CdprError(f"command: {words}; see cdpr --help")
    app = make_app(command_line)
    options, switches = dict(COMMAND_WORDS), set[str]()
    if name != COMPLETION:
        options |= options_of(resolve_name(_verb_of(COMMANDS[name], command_line)))
        switches = {f"--{form}" for form in COMMANDS[name].forms} - set(options.values())

    @app.meta.default
    def meta(
        *words: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
        json: Annotated[bool, Parameter(negative=(), group=SHARED, show_default=False)] = False,
        plot: Annotated[
            list[str] | None, Parameter(metavar="[FIGURE=]FILE", group=SHARED, n_tokens=1)
        ] = None,
    ) -> Call:
        """Runs a subcommand.

        Args:
            json: Print the result as JSON.
            plot: Draw the result, or one of its figures by name; the ending of the file says how.
                May be repeated.
        """
        verb, bound, unparsed = app.parse_args(words, exit_on_error=False, print_error=False)
        for argument, value in bound.arguments.items():
            if isinstance(value, float) and value - value != 0.0:
                raise CdprError(f"{argument}: found {value}; accepted: a finite number")
        figures = dict(map(_figure_file, plot or []))
        return Call(name, verb, bound, "follow" in unparsed, options, json, figures)

    try:
        with named_options(options):
            call = app.meta(
                _joined([word for word in command_line if word not in switches]),
                result_action="return_value", exit_on_error=False, print_error=False,
            )  # fmt: skip
    except CycloptsError as problem:
        raise CdprError(_usage_words(problem, command_line)) from problem
    return call if isinstance(call, Call) else None


def run(command_line: Sequence[str], imported: Callable[[], None]) -> int:
    """Runs a subcommand.

    Args:
        command_line: The command line.
        imported: Called when all that the subcommand needs is imported.

    Returns:
        The exit code.

    Raises:
        CdprError: As `parsed`, or as the verb.
        StoppedError: The work was stopped.
    """
    call = parsed(command_line)
    imported()
    if call is None:
        return 0
    from cdpr_drake.cli.following import following

    with ExitStack() as stack:
        stack.enter_context(named_options(call.options))
        stack.enter_context(nullcontext() if call.name == LIVING else inputs_read_once())
        follow = stack.enter_context(following(call.name, call.long, call.options))
        if call.long:
            call.bound.arguments["follow"] = follow
        result = call.verb(*call.bound.args, **call.bound.kwargs)
        for figure, path in call.figures.items():
            _save(result.plot(figure or None), path)
    if result is None or isinstance(result, int):
        return result or 0
    return _show(result, call)


def _show(result: Any, call: Call) -> int:
    """Prints a result, and on stderr what is missing; returns the exit code."""
    from cdpr_drake.cli.terminal import message_console, wide_console

    console = message_console()
    if call.json:
        print(js.dumps(result.as_dict(), indent=2))
    else:
        result.show(wide_console())
    failed = getattr(result, "failed", {})
    for file, why in failed.items():
        console.print(f"cdpr: {file}: not written: {why}")
    for line in result.notes():
        console.print(with_options(line, call.options))
    return result.exit_code or (INCOMPLETE if failed else 0)


def options_of(verb: Callable[..., Any]) -> dict[str, str]:
    """Options of a verb by the names of its arguments, without its subject and other words."""
    names = {}
    for argument, parameter in _signature(verb).parameters.items():
        if parameter.kind is parameter.KEYWORD_ONLY:
            named = _own_names(parameter)
            names[argument] = named[0] if named else f"--{argument.replace('_', '-')}"
    return names


def _own_names(parameter: inspect.Parameter) -> list[str]:
    """Options that the annotation of an argument names."""
    parts = get_args(parameter.annotation)[1:]
    return [name for part in parts if isinstance(part, Parameter) for name in part.name or ()]


def _option_words(verb: Callable[..., Any]) -> set[str]:
    """All options of a verb, of arguments with a place and second names, too."""
    parameters = inspect.signature(verb, eval_str=True).parameters.values()
    return {*options_of(verb).values(), *(name for each in parameters for name in _own_names(each))}


def _figure_file(word: str) -> tuple[str, Path]:
    """Name of a figure, empty for the first, and its file; refused before anything is computed."""
    name, _, file = word.rpartition("=")
    path = Path(file)
    if path.suffix[1:].lower() not in PICTURES:
        raise CdprError(f"--plot: {path}: found the ending {path.suffix!r}; accepted: "
                        f"{', '.join(PICTURES)}")  # fmt: skip
    if not path.parent.is_dir():
        raise CdprError(f"--plot: {path}: cannot be written: there is no folder {path.parent}")
    return name, path


def _save(figure: Any, path: Path) -> None:
    from cdpr_drake.analyses.frame.figures import save_figure

    save_figure(figure, path)


def _usage_words(problem: CycloptsError, command_line: Sequence[str]) -> str:
    """What is wrong with a command line, in one line with the value found and what is accepted."""
    name = next((word for word in command_line if word in COMMANDS), "")
    words = " ".join(str(problem).split()).rstrip(".")
    token = getattr(problem, "token", None)
    if isinstance(problem, CoercionError) and token is not None and problem.argument is not None:
        option = token.keyword or problem.argument.name
        choices = problem.argument.get_choices()
        kinds = get_args(problem.argument.hint) or (problem.argument.hint,)
        kind = next((KINDS[kind] for kind in kinds if kind in KINDS), "")
        accepted = accepted_names(token.value, choices) if choices else f"accepted: {kind}"
        if choices or kind:
            words = f"{option}: found {token.value!r}; {accepted}"
    elif isinstance(problem, UnknownOptionError) and (owner := _owner(name, problem, command_line)):
        words = f"{problem.token.keyword or problem.token.value}: found {owner[0]}; accepted: "
        words += owner[1]
    elif isinstance(problem, UnusedCliTokensError):
        forms = _forms_in(COMMANDS[name], command_line) if name else []
        form = "".join(f" with --{form}" for form in forms)
        words = f"found {' '.join(problem.unused_tokens or ())!r}{form}; accepted: fewer words"
    elif isinstance(problem, MissingArgumentError) and problem.argument is not None:
        option, info = problem.argument.name, problem.argument.field_info
        only_place = problem.argument.names == (f"--{info.name}",)  # it has no other name
        if info.kind is not info.KEYWORD_ONLY and only_place:
            option = option.lstrip("-").upper()
        words = f"{option}: found nothing; accepted: a value"
    return f"{words}; see cdpr {name} --help".replace("  ", " ")


def _owner(
    name: str, problem: UnknownOptionError, command_line: Sequence[str]
) -> tuple[str, str] | None:
    """How a command was called, and how it takes an option that this form of it has not."""
    if name not in COMMANDS:
        return None
    command, option = (
        COMMANDS[name],
        (problem.token.keyword or problem.token.value).partition("=")[0],
    )
    without = " and ".join(f"without --{form}" for form in command.forms)
    verbs = {
        without: command.verb,
        **{f"with --{f}": verb for f, (verb, _) in command.forms.items()},
    }
    owners = [how for how, verb in verbs.items() if option in _option_words(resolve_name(verb))]
    called = [f"with --{form}" for form in _forms_in(command, command_line)]
    return (called[0] if called else without, " or ".join(owners)) if owners else None
