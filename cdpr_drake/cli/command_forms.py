"""Forms of commands for the studio, made from the functions of the commands themselves."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, get_args, get_origin, get_type_hints

from typer.models import OptionInfo

from cdpr_drake.cli.app import make_app
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.cli.replay import replay
from cdpr_drake.cli.study import study
from cdpr_drake.studio.workbench.command_form import CommandForm, CommandOption, OptionKind

OFFERED: dict[str, Callable[..., Any]] = {
    "study": study,
    "replay": replay,
}
"""Commands that the studio runs."""

LEFT_OUT = {"out", "json", "overwrite", "help", "scheduler", "along", "threshold",
            "robot"}  # fmt: skip
"""Options that are the studio's own business, or of another use of the command."""

KINDS_OF = {
    bool: OptionKind.FLAG, int: OptionKind.INTEGER, float: OptionKind.NUMBER, Path: OptionKind.FILE,
}  # fmt: skip


def command_forms() -> dict[str, CommandForm]:
    """Forms of the commands in `OFFERED` by name."""
    forms = {name: _form_of_verb(name) for name in ("workspace", "stability")}
    return forms | {name: _form(name, function) for name, function in OFFERED.items()}


def _form_of_verb(name: str) -> CommandForm:
    verb = resolve_name(COMMANDS[name].verb)
    parameters = inspect.signature(verb).parameters
    options = []
    for argument in make_app([name])[name].assemble_argument_collection(parse_docstring=True):
        parameter, option = parameters[argument.field_info.name], argument.name
        if parameter.default is parameter.empty or not argument.show:
            continue
        usual = parameter.default
        if isinstance(usual, tuple | list):
            usual = ",".join(map(str, usual))
        kinds = [part for part in get_args(argument.hint) if part is not type(None)]
        shown = CommandOption(
            name=option, words=str(argument.parameter.help or ""),
            kind=KINDS_OF.get((kinds or [argument.hint])[0], OptionKind.TEXT),
            many=parameter.name in ("velocities", "orientation", "vary"),
            usual="" if usual is None or isinstance(usual, bool) else str(usual),
        )  # fmt: skip
        if shown.key not in LEFT_OUT:
            options.append(shown)
    return CommandForm(name, COMMANDS[name].line, tuple(options))


def _form(name: str, function: Callable[..., Any]) -> CommandForm:
    hints = get_type_hints(function, include_extras=True)
    options = []
    for parameter in inspect.signature(function).parameters.values():
        hint = hints[parameter.name]
        info = next((each for each in get_args(hint)[1:] if isinstance(each, OptionInfo)), None)
        if info is None:
            continue
        option = _option(parameter, get_args(hint)[0], info)
        if option.key not in LEFT_OUT:
            options.append(option)
    words = (function.__doc__ or "").strip().splitlines()[0]
    return CommandForm(name, words, tuple(options))


def _option(parameter: inspect.Parameter, hint: Any, info: OptionInfo) -> CommandOption:
    """An option from a parameter of a command, what it is declared as, and its own words."""
    parts = [part for part in get_args(hint) if part is not type(None)]
    plain = parts[0] if parts and get_origin(hint) is not list else hint
    many = get_origin(plain) is list
    declared = (info.default, *(info.param_decls or ()))  # Annotated puts the first one there
    named = [word for word in declared if isinstance(word, str) and word.startswith("--")]
    usual = parameter.default
    return CommandOption(
        name=named[0].partition("/")[0] if named else f"--{parameter.name.replace('_', '-')}",
        words=str(info.help or ""),
        kind=KINDS_OF.get(plain, OptionKind.TEXT),
        many=many,
        usual="" if usual is None or isinstance(usual, bool) else str(usual),
    )
