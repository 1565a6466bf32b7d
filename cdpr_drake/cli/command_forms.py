"""Forms of commands for the studio, made from the functions of the commands themselves."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from typer.models import OptionInfo

from cdpr_drake.cli.replay import replay
from cdpr_drake.cli.stability import stability
from cdpr_drake.cli.study import study
from cdpr_drake.cli.workspace import workspace
from cdpr_drake.studio.workbench.command_form import CommandForm, CommandOption, OptionKind

OFFERED: dict[str, Callable[..., Any]] = {
    "workspace": workspace,
    "stability": stability,
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
    return {name: _form(name, function) for name, function in OFFERED.items()}


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
