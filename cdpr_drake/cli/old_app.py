"""The `cdpr` command: its subcommands, and how errors reach the user."""

from __future__ import annotations

import ast
import faulthandler
import gc
import keyword
import logging
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from cdpr_drake.blas_threads import (
    begin_with_one_thread,
    one_blas_thread,
    started_with_one_thread,
)
from cdpr_drake.cli.command_help import COMMANDS, examples_of, first_steps, groups
from cdpr_drake.cli.completion import PROGRAM, asked_words, stand_in
from cdpr_drake.cli.option_names import SHARED_OPTIONS, with_options
from cdpr_drake.cli.process import INTERRUPTED, SIGNALS, compile_ahead, exit_with_parent
from cdpr_drake.errors import CdprError, plain_words
from cdpr_drake.kernel_cache.locks import share_compilation
from cdpr_drake.schema.input_files import inputs_read_once
from cdpr_drake.version import __version__

TRACEBACK = "CDPR_TRACEBACK"
"""Environment variable that lets errors through which Drake or Python raised."""

LONGEST_LINE = 490
"""Characters of a message behind `cdpr: `; longer ones lose their middle."""

LIVING = "studio"
"""The subcommand that goes on while files change; any other reads each file once."""

BAD_INPUT = 2
"""Exit code when the user's input is not accepted."""

_UsageProblem: type[Exception] = next(
    kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException"
)
"""Base of what typer raises for wrong options; typer may bring its own copy of click."""


def _function_of(name: str) -> str:
    """Name of a subcommand's function, and of its module: `import` is a word of Python."""
    return f"{name}_" if keyword.iskeyword(name) else name.replace("-", "_")


SUBCOMMANDS = {name: f"cdpr_drake.cli.{_function_of(name)}" for name in COMMANDS}
"""Subcommands in the order of the help, each with the module whose function of that name it is.

What a subcommand prints as help is the function's docstring, or what the module's `help_words`
returns, where that follows from a table."""


class _Interrupted(Exception):
    """A Ctrl-C with what was noted on it, of which typer would make a mere exit code."""


class _Subcommands(TyperGroup):
    """Lets a Ctrl-C through; its help has the whole first line of each subcommand."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        for title, names in groups().items():
            helps = [(name, self.commands[name].help or "") for name in names]
            with formatter.section(title):
                formatter.write_dl([(name, help.partition("\n\n")[0]) for name, help in helps])

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as problem:
            interrupted = _Interrupted()
            for note in getattr(problem, "__notes__", ()):
                interrupted.add_note(note)
            raise interrupted from problem


def make_app(arguments: Sequence[str] = ()) -> typer.Typer:
    """The command with the subcommands that the table has now.

    Only the subcommand that is asked for is imported: Drake alone takes as long as all else that a
    question such as `cdpr --help` needs. Of the others the help has the first line; where the very
    first word is a subcommand nobody sees that help, and none of them is there.
    """
    given = asked_words() or arguments
    asked = next((word for word in given if not word.startswith("-")), None)
    only = asked_words() is None and asked in SUBCOMMANDS and given[0] == asked
    app = typer.Typer(
        name=PROGRAM,
        cls=_Subcommands,
        help="Cable-driven parallel robots in Drake.",
        invoke_without_command=True,
        # markdown leaves units such as [m] alone; the plain list of subcommands takes half the time
        rich_markup_mode="markdown" if only else None,
        pretty_exceptions_enable=False,
        callback=_options,
    )
    for name, where in SUBCOMMANDS.items():
        if only and name != asked:
            continue
        words = None if name == asked else _first_line(name, where)
        if words is not None:
            app.command(name, help=words)(_not_imported)
            continue
        names_only = stand_in(name)
        if names_only is not None:
            app.command(name)(names_only)
            continue
        module = import_module(where)
        help_words = getattr(module, "help_words", lambda: None)()
        function = getattr(module, _function_of(name))
        app.command(name, help=help_words, epilog=examples_of(name))(function)
    return app


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
        from importlib.metadata import version

        print(f"cdpr_drake {__version__}, Drake {version('drake')}")
        raise typer.Exit


def _options(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_version,
            is_eager=True,
            help="Print the versions of the package and of Drake.",
        ),
    ] = False,
) -> None:
    """Cable-driven parallel robots in Drake."""
    if context.invoked_subcommand is None:
        print(first_steps())
        raise typer.Exit


PARSED = {
    "int_parsing": "a whole number", "int_from_float": "a whole number",
    "int_parsing_size": "a whole number of fewer digits", "float_parsing": "a number",
}  # fmt: skip
"""What options take, by pydantic's names of what is wrong with a value."""

BOUNDS = {
    "greater_than_equal": ("ge", "at least"), "less_than_equal": ("le", "at most"),
    "greater_than": ("gt", "above"), "less_than": ("lt", "below"),
}  # fmt: skip
"""The bound that a value misses, by the same: its key, and words."""


def _accepted(refused: dict[str, Any]) -> str:
    """What is accepted in the place of a value that pydantic refused; empty: it says so itself."""
    if refused["type"] in BOUNDS:
        key, words = BOUNDS[refused["type"]]
        return f"{words} {refused['ctx'][key]:g}"
    return PARSED.get(refused["type"], "")


def _usage_words(problem: Exception) -> str:
    """What typer says about options in one line, with the value found and where there is help."""
    words = str(getattr(problem, "format_message", problem.__str__)()).rstrip(".")
    # Where pydantic refused a value, typer keeps it to itself.
    refused: list[dict[str, Any]] = getattr(problem.__cause__, "errors", list)()
    if refused and "input" in refused[0]:
        option = re.match(r"Invalid value for '?([^':]+)'?:", words)
        accepted = _accepted(refused[0])
        if option is not None and accepted:
            words = f"{option[1]}: found {refused[0]['input']!r}; accepted: {accepted}"
        else:
            words += f"; found {refused[0]['input']!r}"
    context = getattr(problem, "ctx", None)
    command = "" if context is None or context.parent is None else f"{context.info_name} "
    return f"{words}; see cdpr {command}--help"


def _is_error(record: logging.LogRecord) -> bool:
    """Whether Drake has more to say than that it has opened a page."""
    return record.levelno >= logging.ERROR


def _notes(problem: BaseException) -> str:
    """What was noted on a problem on its way here, such as where the log of a run is kept."""
    notes = getattr(problem, "__notes__", ())
    return "".join(f"; {with_options(note, SHARED_OPTIONS)}" for note in notes)


def _refuse(words: str) -> NoReturn:
    """Says a line of at most `LONGEST_LINE` characters for each problem, and ends."""
    for problem in words.splitlines() or [""]:
        line = plain_words(problem).replace("\t", r"\t")
        if len(line) > LONGEST_LINE:
            line = f"{line[: LONGEST_LINE * 3 // 4]} ... {line[-LONGEST_LINE // 5 :]}"
        print(f"cdpr: {line}", file=sys.stderr)
    sys.exit(BAD_INPUT)


def main(arguments: list[str] | None = None) -> None:
    """Runs the command; a `CdprError` becomes one line on stderr and exit code 2.

    Without arguments it is the program of this process: SIGTERM ends it as Ctrl-C does, and both
    end it at once when there is nothing left to do. Garbage is never searched for among what is
    imported: that stays, and each search would walk through hundreds of thousands of objects.
    """
    if arguments is not None:  # somebody else's process
        held = one_blas_thread() if "numpy" in sys.modules else nullcontext()
        with held, started_with_one_thread():  # NumPy reads the environment when it is loaded
            _main(arguments)
        return
    begin_with_one_thread()
    for each in SIGNALS:
        signal.signal(each, _end_at_once)
    gc.disable()
    try:
        _main(sys.argv[1:], _begin)
    finally:
        for each in SIGNALS:
            signal.signal(each, signal.SIG_DFL)


def _end_at_once(number: int, frame: FrameType | None) -> None:
    """Ends a program that is still being imported, when nothing is begun.

    An exception would come out of Drake's own initialisation as an ImportError.
    """
    with suppress(OSError):
        os.write(2, b"cdpr: stopped\n")
    os._exit(INTERRUPTED)


def _begin() -> None:
    """From here on the subcommand runs, and an interruption is for it."""
    from cdpr_drake.cli.compiling import pause_for_compilation  # it looks which helpers there are

    pause_for_compilation()
    gc.freeze()
    gc.enable()
    for each in SIGNALS:
        signal.signal(each, signal.default_int_handler)


def _was_interrupted(problem: BaseException) -> bool:
    """Whether a Ctrl-C is behind it: compiled modules and classes in the making wrap it."""
    cause: BaseException | None = problem
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def _main(given: Sequence[str], imported: Callable[[], None] = lambda: None) -> None:
    """Runs the command, and ends by SystemExit; `imported` is called before the subcommand is."""
    exit_with_parent()
    # A filter, as Drake sets the level itself when a subcommand imports it.
    logging.getLogger("drake").addFilter(_is_error)
    if not faulthandler.is_enabled():
        with suppress(OSError, ValueError, RuntimeError):  # no stderr, or one that is no file
            faulthandler.enable(sys.stderr)  # a crash of a library is never silent
    encoding = sys.getfilesystemencoding()
    if encoding != "utf-8":  # Drake does not start there
        print(
            f"cdpr: found a locale with the encoding {encoding}; accepted: one with UTF-8, such as "
            "LC_ALL=C.UTF-8",
            file=sys.stderr,
        )
        sys.exit(BAD_INPUT)
    try:
        if asked_words() is None:
            compile_ahead(given)
        app = make_app(given)  # which imports Drake and numba if the subcommand does
        share_compilation()
        imported()
        with nullcontext() if LIVING in given else inputs_read_once():
            code = app(args=given, prog_name=PROGRAM, standalone_mode=False)
    except OSError as problem:  # such as a full disk, or a folder that vanished
        where = f"{problem.filename}: " if problem.filename else ""
        _refuse(f"{where}{problem.strerror or problem}{_notes(problem)}")
    except CdprError as problem:
        _refuse(f"{with_options(str(problem), SHARED_OPTIONS)}{_notes(problem)}")
    except _UsageProblem as problem:
        _refuse(_usage_words(problem))
    except (MemoryError, ArithmeticError, RuntimeError, ImportError) as problem:
        if _was_interrupted(problem):
            print(f"cdpr: stopped{plain_words(_notes(problem))}", file=sys.stderr)
            sys.exit(INTERRUPTED)
        if isinstance(problem, ImportError):
            raise
        # Numbers that nothing can be computed with, and what Drake refuses. Mistakes of this
        # program, such as KeyError, stay tracebacks.
        if os.environ.get(TRACEBACK):
            raise
        kind, words = type(problem).__name__, " ".join(str(problem).split())
        why = f"{words or 'nothing more is known'}; {TRACEBACK}=1 shows where"
        _refuse(f"{kind}: {why}{_notes(problem)}")
    except (typer.Abort, KeyboardInterrupt, _Interrupted) as problem:
        print(f"cdpr: stopped{plain_words(_notes(problem))}", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except Exception as problem:  # compilers and compiled modules wrap what they are stopped by
        if not _was_interrupted(problem):
            raise
        print(f"cdpr: stopped{plain_words(_notes(problem))}", file=sys.stderr)
        sys.exit(INTERRUPTED)
    sys.exit(code if isinstance(code, int) else 0)
