"""The `cdpr` command: makes subcommands of verbs, runs one, shows its result or why there is none.

What a subcommand accepts stands in the signature and the docstring of its verb, see `COMMANDS`.
"""

from __future__ import annotations

import faulthandler
import gc
import inspect
import json as js
import logging
import os
import re
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, nullcontext, suppress
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, NoReturn, get_args

from cyclopts import App, CoercionError, CycloptsError, Group, MissingArgumentError, Parameter

from cdpr_drake.blas_threads import ONE_THREAD, one_blas_thread, started_with_one_thread
from cdpr_drake.cli.commands import COMMANDS, FIRST_STEPS, Command
from cdpr_drake.cli.option_names import with_options
from cdpr_drake.cli.process import INTERRUPTED, SIGNALS, compile_ahead, exit_with_parent
from cdpr_drake.errors import CdprError, StoppedError, accepted_names, plain_words
from cdpr_drake.kernel_cache.locks import share_compilation
from cdpr_drake.schema.input_files import inputs_read_once
from cdpr_drake.version import __version__

TRACEBACK = "CDPR_TRACEBACK"
"""Environment variable that lets errors through which Drake or Python raised."""

LONGEST_LINE = 490
"""Characters of a message behind `cdpr: `; longer ones lose their middle."""

LIVING = "studio"
"""The subcommand that goes on while files change; any other reads each file once."""

BAD_INPUT, INCOMPLETE = 2, 3
"""Exit codes: the input is not accepted; numbers are complete, and a figure is missing."""

PICTURES = ("png", "pdf", "svg", "jpg", "jpeg", "tif", "tiff", "webp", "eps", "ps", "pgf")
"""Endings of files of --plot."""

KINDS = {int: "a whole number", float: "a number", bool: "true or false"}
"""What words of an option have to be, by the type of its argument."""

SHARED = Group("Of all commands", sort_key=100)


def make_app(given: Sequence[str]) -> App:
    """The command. Of subcommands that are not asked for, the help has the first line only."""
    asked = next((word for word in given if not word.startswith("-")), "")
    app = App(
        name="cdpr", help="Cable-driven parallel robots in Drake.", version=_version,
        help_format="markdown" if asked else "plaintext", help_flags=("--help",),
        default_parameter=Parameter(negative_iterable=(), negative_none=()),
    )  # fmt: skip
    titles = dict.fromkeys(command.group for command in COMMANDS.values())
    groups = {title: Group(title, sort_key=k) for k, title in enumerate(titles)}
    for name, command in COMMANDS.items():
        words = {} if name == asked else {"help": command.line}
        examples = "\n\n".join(("Examples:", *(f"`{line}`" for line in command.examples)))
        for option in command.instead:
            examples += f"\n\nAnother question: `cdpr {name} --{option}`, with `--help` for more"
        app.command(
            _verb_of(command, given) if name == asked else command.verb,
            name=name,
            group=groups[command.group],
            help_epilogue=examples,
            **words,
        )
    app.default(_show_first_steps)
    app.meta.suppress_keyboard_interrupt = False
    app.register_install_completion_command(name="completion", group=groups["Tools"])
    return app


def _verb_of(command: Command, given: Sequence[str]) -> str:
    """Module and function that answer a command line."""
    options = {word.partition("=")[0].removeprefix("--") for word in given if word[:2] == "--"}
    return next((verb for name, verb in command.instead.items() if name in options), command.verb)


def _joined(given: Sequence[str]) -> list[str]:
    """Words of a command line in which a negative number belongs to the option before it."""
    words: list[str] = []
    for word in given:
        if re.match(r"-[\d.]", word) and words and re.fullmatch(r"--[a-z-]+", words[-1]):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _version() -> str:
    from importlib.metadata import version

    return f"cdpr_drake {__version__}, Drake {version('drake')}"


def _show_first_steps() -> None:
    width = max(map(len, FIRST_STEPS))
    steps = (f"  {line:<{width}}  {words}" for line, words in FIRST_STEPS.items())
    print("Cable-driven parallel robots in Drake. To begin:", "", *steps, sep="\n")
    print("\ncdpr --help lists the rest.")


class _Call:
    """One call of the command.

    Attributes:
        options: Options of its verb by the names of arguments, for messages.
    """

    def __init__(self, imported: Callable[[], None]) -> None:
        self.options: dict[str, str] = {}
        self._imported = imported

    def run(self, given: Sequence[str]) -> int:
        """Runs the subcommand, and returns the exit code."""
        app = make_app(given)

        @app.meta.default
        def meta(
            *words: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
            json: Annotated[bool, Parameter(negative=(), group=SHARED, show_default=False)] = False,
            plot: Annotated[
                list[str] | None, Parameter(metavar="[FIGURE=]FILE", group=SHARED, n_tokens=1)
            ] = None,
        ) -> int:
            """Runs a subcommand.

            Args:
                json: Print the result as JSON.
                plot: Draw the result, or one of its figures by name; the ending of the file says
                    how. May be repeated.
            """
            verb, bound, unparsed = app.parse_args(words, exit_on_error=False, print_error=False)
            self._imported()
            figures = dict(map(_figure_file, plot or []))
            return self._answer(words, verb, bound, unparsed, json, figures)

        code = app.meta(
            _joined(given), result_action="return_value", exit_on_error=False, print_error=False
        )
        return code if isinstance(code, int) else 0

    def _answer(
        self, words: Sequence[str], verb: Callable[..., Any], bound: inspect.BoundArguments,
        unparsed: Mapping[str, Any], json: bool, figures: Mapping[str, Path],
    ) -> int:  # fmt: skip
        from cdpr_drake.cli.following import following
        from cdpr_drake.cli.terminal import message_console, wide_console

        name = words[0] if words else ""
        self.options = options_of(verb)
        for argument, value in bound.arguments.items():
            if isinstance(value, float) and value - value != 0.0:
                option = self.options.get(argument, argument)
                raise CdprError(f"{option}: found {value}; accepted: a finite number")
        console = message_console()
        with ExitStack() as stack:
            stack.enter_context(nullcontext() if name == LIVING else inputs_read_once())
            follow = stack.enter_context(following(name, "follow" in unparsed, self.options))
            if "follow" in unparsed:
                bound.arguments["follow"] = follow
            result = verb(*bound.args, **bound.kwargs)
            for figure, path in figures.items():
                _save(result.plot(figure or None), path)
        if result is None or isinstance(result, int):
            return result or 0
        if json:
            print(js.dumps(result.as_dict(), indent=2))
        else:
            result.show(wide_console())
        failed = getattr(result, "failed", {})
        for file, why in failed.items():
            console.print(f"cdpr: {file}: not written: {why}")
        for line in result.notes():
            console.print(with_options(line, self.options))
        return result.exit_code or (INCOMPLETE if failed else 0)


def options_of(verb: Callable[..., Any]) -> dict[str, str]:
    """Options of a verb by the names of its arguments that have a default."""
    found = {}
    for argument, parameter in inspect.signature(verb, eval_str=True).parameters.items():
        if parameter.default is parameter.empty:
            continue
        names = [
            name for part in get_args(parameter.annotation)[1:]
            if isinstance(part, Parameter) for name in part.name or ()
        ]  # fmt: skip
        found[argument] = names[0] if names else f"--{argument.replace('_', '-')}"
    return found


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
    from cdpr_drake.analyses.visualization.figure_files import save_figure

    save_figure(figure, path)


def _usage_words(problem: CycloptsError, given: Sequence[str]) -> str:
    """What is wrong with a command line, in one line with the value found and what is accepted."""
    name = next((word for word in given if word in COMMANDS), "")
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
    elif isinstance(problem, MissingArgumentError) and problem.argument is not None:
        required = problem.argument.field_info.required
        option = problem.argument.name.lstrip("-").upper() if required else problem.argument.name
        words = f"{option}: found nothing; accepted: a value"
    return f"{words}; see cdpr {name} --help".replace("  ", " ")


def _is_error(record: logging.LogRecord) -> bool:
    """Whether Drake has more to say than that it has opened a page."""
    return record.levelno >= logging.ERROR


def _notes(problem: BaseException) -> str:
    """What was noted on a problem on its way here, such as where the log of a run is kept."""
    return "".join(f"; {note}" for note in getattr(problem, "__notes__", ()))


def _refuse(words: str) -> NoReturn:
    """Says a line of at most `LONGEST_LINE` characters for each problem, and ends."""
    for problem in words.splitlines() or [""]:
        line = plain_words(problem).replace("\t", r"\t")
        if len(line) > LONGEST_LINE:
            line = f"{line[: LONGEST_LINE * 3 // 4]} ... {line[-LONGEST_LINE // 5 :]}"
        print(f"cdpr: {line}", file=sys.stderr)
    sys.exit(BAD_INPUT)


def _stop(problem: BaseException) -> NoReturn:
    print(f"cdpr: stopped{plain_words(_notes(problem))}", file=sys.stderr)
    sys.exit(INTERRUPTED)


def main(arguments: list[str] | None = None) -> None:
    """Runs the command; a `CdprError` becomes one line on stderr and exit code 2.

    Without arguments it is the program of this process: SIGTERM ends it as Ctrl-C does, and both
    end it at once when there is nothing left to do. Garbage is never searched for among what is
    imported: that stays, and each search would walk through hundreds of thousands of objects.
    """
    if arguments is not None:  # somebody else's process
        held = one_blas_thread() if "numpy" in sys.modules else nullcontext()
        with held, started_with_one_thread():  # NumPy reads the environment when it is loaded
            _main(arguments, lambda: None)
        return
    os.environ.update(ONE_THREAD)  # before NumPy is loaded
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


def _main(given: Sequence[str], imported: Callable[[], None]) -> NoReturn:
    """Runs the command, and ends by SystemExit; `imported` is called before the verb is."""
    exit_with_parent()
    # A filter, as Drake sets the level itself when a subcommand imports it.
    logging.getLogger("drake").addFilter(_is_error)
    if not faulthandler.is_enabled():
        with suppress(OSError, ValueError, RuntimeError):  # no stderr, or one that is no file
            faulthandler.enable(sys.stderr)  # a crash of a library is never silent
    encoding = sys.getfilesystemencoding()
    if encoding != "utf-8":  # Drake does not start there
        _refuse(f"found a locale with the encoding {encoding}; accepted: one with UTF-8, such as "
                "LC_ALL=C.UTF-8")  # fmt: skip
    compile_ahead(given)
    share_compilation()
    call = _Call(imported)
    if given and given[0] not in COMMANDS and given[0] not in ("--help", "--version"):
        from cdpr_drake.cli import old_app

        old_app._main(given, imported)
    try:
        sys.exit(call.run(given))
    except OSError as problem:  # such as a full disk, or a folder that vanished
        where = f"{problem.filename}: " if problem.filename else ""
        _refuse(f"{where}{problem.strerror or problem}{_notes(problem)}")
    except StoppedError as problem:
        print(f"cdpr: {plain_words(str(problem))}", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except CdprError as problem:
        _refuse(with_options(f"{problem}{_notes(problem)}", call.options))
    except CycloptsError as problem:
        _refuse(_usage_words(problem, given))
    except KeyboardInterrupt as problem:
        _stop(problem)
    except (MemoryError, ArithmeticError, RuntimeError) as problem:
        if _was_interrupted(problem):
            _stop(problem)
        # Numbers that nothing can be computed with, and what Drake refuses. Mistakes of this
        # program, such as KeyError, stay tracebacks.
        if os.environ.get(TRACEBACK):
            raise
        kind, words = type(problem).__name__, " ".join(str(problem).split())
        why = f"{words or 'nothing more is known'}; {TRACEBACK}=1 shows where"
        _refuse(f"{kind}: {why}{_notes(problem)}")
    except Exception as problem:  # compilers and compiled modules wrap what they are stopped by
        if not _was_interrupted(problem):
            raise
        _stop(problem)
