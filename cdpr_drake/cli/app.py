"""The `cdpr` command: its subcommands, and how errors reach the user."""

from __future__ import annotations

import ast
import logging
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.cli.stop_request import INTERRUPTED
from cdpr_drake.errors import CdprError

BAD_INPUT = 2
"""Exit code when the user's input is not accepted."""

_UsageProblem: type[Exception] = next(
    kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException"
)
"""Base of what typer raises for wrong options; typer may bring its own copy of click."""

SUBCOMMANDS = {
    name: f"cdpr_drake.cli.{name}"
    for name in (
        "simulate", "tension", "static", "stability", "workspace", "study", "robots", "view",
        "doctor", "bench",
    )
}  # fmt: skip
"""Subcommands in the order of the help, each with the module whose function of that name it is.

What a subcommand prints as help is the function's docstring, or what the module's `help_words`
returns, where that follows from a table."""


def make_app(arguments: Sequence[str] = ()) -> typer.Typer:
    """The command with the subcommands that the table has now.

    Only the subcommand that is asked for is imported: Drake alone takes as long as all else that a
    question such as `cdpr --help` needs. Of the others the help has the first line.
    """
    app = typer.Typer(
        name="cdpr",
        help="Cable-driven parallel robots in Drake.",
        invoke_without_command=True,
        add_completion=False,
        rich_markup_mode="markdown",  # which leaves units such as [m] alone
        pretty_exceptions_enable=False,
        callback=_options,
    )
    asked = next((word for word in arguments if not word.startswith("-")), None)
    for name, where in SUBCOMMANDS.items():
        words = None if name == asked else _first_line(name, where)
        if words is not None:
            app.command(name, help=words)(_not_imported)
            continue
        module = import_module(where)
        help_words = getattr(module, "help_words", lambda: None)()
        app.command(name, help=help_words)(getattr(module, _function_of(name)))
    return app


def _function_of(name: str) -> str:
    return name.replace("-", "_")


def _not_imported() -> None:
    """Stands for a subcommand that was not asked for."""


def _first_line(name: str, where: str) -> str | None:
    """First line of a subcommand's docstring, from its source; None where that cannot be read."""
    try:
        found = find_spec(where)
        source = Path(str(found and found.origin)).read_text(encoding="utf-8")
    except (OSError, ImportError, ValueError):
        return None
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef) and node.name == _function_of(name):
            return (ast.get_docstring(node) or "").partition("\n\n")[0]
    return None


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"cdpr_drake {version('cdpr_drake')}, Drake {version('drake')}")
        raise typer.Exit


def _options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Versions.")
    ] = False,
) -> None:
    """Cable-driven parallel robots in Drake."""
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit(BAD_INPUT)


def _usage_words(problem: Exception) -> str:
    """What typer says about options in one line, with the value found and where there is help."""
    words = str(getattr(problem, "format_message", problem.__str__)()).rstrip(".")
    # Where pydantic refused a value, typer keeps it to itself.
    refused: list[dict[str, object]] = getattr(problem.__cause__, "errors", list)()
    if refused and "input" in refused[0]:
        words += f"; found {refused[0]['input']!r}"
    context = getattr(problem, "ctx", None)
    command = "" if context is None or context.parent is None else f"{context.info_name} "
    return f"{words}; see cdpr {command}--help"


def main(arguments: list[str] | None = None) -> None:
    """Runs the command; a `CdprError` becomes one line on stderr and exit code 2."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    encoding = sys.getfilesystemencoding()
    if encoding != "utf-8":  # Drake does not start there
        print(
            f"cdpr: found a locale with the encoding {encoding}; accepted: one with UTF-8, such as "
            "LC_ALL=C.UTF-8",
            file=sys.stderr,
        )
        sys.exit(BAD_INPUT)
    try:
        given = sys.argv[1:] if arguments is None else arguments
        code = make_app(given)(args=given, standalone_mode=False)
    except OSError as problem:  # such as a full disk, or a folder that vanished
        where = f"{problem.filename}: " if problem.filename else ""
        print(f"cdpr: {where}{problem.strerror or problem}", file=sys.stderr)
        sys.exit(BAD_INPUT)
    except CdprError as problem:
        print(f"cdpr: {problem}", file=sys.stderr)
        sys.exit(BAD_INPUT)
    except _UsageProblem as problem:
        print(f"cdpr: {_usage_words(problem)}", file=sys.stderr)
        sys.exit(BAD_INPUT)
    except (typer.Abort, KeyboardInterrupt):
        sys.exit(INTERRUPTED)
    sys.exit(code if isinstance(code, int) else 0)
