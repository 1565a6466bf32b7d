"""Forms of commands for the studio, made from the signatures of their verbs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

from cdpr_drake.cli.call import shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.studio.workbench.command_form import CommandForm, CommandOption, OptionKind

OFFERED = ("workspace", "stability", "study", "replay")
"""Commands that the studio runs."""

LEFT_OUT = {"out", "overwrite", "along", "threshold", "robot"}
"""Options that are the studio's own business, or of another use of the command."""

KINDS = {
    bool: OptionKind.FLAG, int: OptionKind.INTEGER, float: OptionKind.NUMBER, Path: OptionKind.FILE,
}  # fmt: skip

FILES = ("FILE", "FOLDER")
"""What the help of options says that take the path of one."""


def command_forms() -> dict[str, CommandForm]:
    """Forms of the commands in `OFFERED` by name."""
    return {name: _form(name) for name in OFFERED if name in COMMANDS}


def _form(name: str) -> CommandForm:
    options = []
    for argument in shown_arguments(name):
        about, option = argument.field_info, argument.name
        if not about.is_keyword_only or option.removeprefix("--") in LEFT_OUT:
            continue
        usual = about.default
        if isinstance(usual, tuple | list):
            usual = ",".join(map(str, usual))
        options.append(CommandOption(
            name=option,
            words=" ".join(str(argument.parameter.help or "").split()),
            kind=_kind(argument.hint, argument.parameter.metavar),
            many=getattr(argument.parameter.converter, "many", False),
            usual="" if usual in (None, about.empty) or isinstance(usual, bool) else str(usual),
        ))  # fmt: skip
    return CommandForm(name, COMMANDS[name].line, tuple(options))


def _kind(hint: Any, metavar: str | None) -> OptionKind:
    if metavar in FILES:
        return OptionKind.FILE
    kinds = [kind for kind in get_args(hint) if kind is not type(None)] or [hint]
    return KINDS.get(kinds[0], OptionKind.TEXT)
