"""The `cdpr` command as a process: its overview, its signals, how errors reach the user."""

from __future__ import annotations

import faulthandler
import gc
import logging
import os
import shutil
import signal
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from types import FrameType
from typing import NoReturn

from cdpr_drake.blas_threads import (
    begin_with_one_thread,
    one_blas_thread,
    started_with_one_thread,
)
from cdpr_drake.cli.commands import COMMANDS, FIRST_STEPS
from cdpr_drake.cli.process import (
    INTERRUPTED,
    SIGNALS,
    compile_ahead,
    exit_with_parent,
)
from cdpr_drake.errors import CdprError, ClientEndedError, StoppedError, plain_words
from cdpr_drake.kernel_cache.locks import share_compilation
from cdpr_drake.version import __version__

TRACEBACK = "CDPR_TRACEBACK"
"""Environment variable that lets errors through which Drake or Python raised."""

LONGEST_LINE = 490
"""Characters of a message behind `cdpr: `; longer ones lose their middle."""

BAD_INPUT = 2
"""Exit code when the user's input is not accepted."""

WIDEST = 100
"""Of the overview [characters]."""


def _overview() -> str:
    """All subcommands by what they are for."""
    width = min(shutil.get_terminal_size().columns, WIDEST)
    longest = max(
        len(f"{name} --{form}") if form else len(name)
        for name, command in COMMANDS.items() for form in ("", *command.forms)
    )  # fmt: skip
    lines = ["Usage: cdpr COMMAND [OPTIONS]", "", "Cable-driven parallel robots in Drake."]
    for group in dict.fromkeys(command.group for command in COMMANDS.values()):
        lines += ["", f"{group}:"]
        for name, command in COMMANDS.items():
            forms = {f"{name} --{form}": line for form, (_, line) in command.forms.items()}
            if command.group == group:
                for words, line in {name: command.line, **forms}.items():
                    lines += textwrap.wrap(
                        line, width, initial_indent=f"  {words:<{longest}}  ",
                        subsequent_indent=" " * (longest + 4),
                    )  # fmt: skip
    return "\n".join([
        *lines, "",
        "Of all commands: --json prints the result as JSON, --plot [FIGURE=]FILE draws it.",
        "cdpr COMMAND --help has its options and examples, cdpr --version the versions.",
        "cdpr completion lets the Tab key complete commands, options and names.",
    ])  # fmt: skip


def _first_steps() -> str:
    """What `cdpr` alone shows."""
    width = max(map(len, FIRST_STEPS))
    steps = (f"  {line:<{width}}  {words}" for line, words in FIRST_STEPS.items())
    title = "Cable-driven parallel robots in Drake. To begin:"
    return "\n".join([title, "", *steps, "", "cdpr --help lists the rest."])


def _version() -> str:
    from importlib.metadata import version

    return f"cdpr_drake {__version__}, Drake {version('drake')}"


AT_ONCE: dict[tuple[str, ...], Callable[[], str]] = {
    (): _first_steps, ("--help",): _overview, ("--version",): _version,
}  # fmt: skip
"""What is answered without anything that a subcommand needs."""


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

    Without arguments it is the program of this process, see `_own_process`.
    """
    place = _own_process() if arguments is None else _process_of_others()
    with place as begin, _problems_in_words():
        command_line = sys.argv[1:] if arguments is None else arguments
        exit_with_parent()
        # A filter, as Drake sets the level itself when a subcommand imports it.
        logging.getLogger("drake").addFilter(_is_error)
        if not faulthandler.is_enabled():
            with suppress(OSError, ValueError, RuntimeError):  # no stderr, or one that is no file
                faulthandler.enable(sys.stderr)  # a crash of a library is never silent
        encoding = sys.getfilesystemencoding()
        if encoding != "utf-8":  # Drake does not start there
            raise CdprError(f"found a locale with the encoding {encoding}; accepted: one with "
                            "UTF-8, such as LC_ALL=C.UTF-8")  # fmt: skip
        if tuple(command_line) in AT_ONCE:
            print(AT_ONCE[tuple(command_line)]())
            sys.exit(0)
        compile_ahead(command_line)
        share_compilation()
        from cdpr_drake.cli.call import run  # and with it the parser

        sys.exit(run(command_line, begin))


@contextmanager
def _own_process() -> Iterator[Callable[[], None]]:
    """The process is this program's: SIGTERM ends it as Ctrl-C does.

    Both end it at once before the subcommand runs and when there is nothing left to do. Garbage is
    never searched for among what is imported: that stays, and each search would walk through
    hundreds of thousands of objects.

    Yields:
        What is called when all is imported.
    """
    begin_with_one_thread()
    for each in SIGNALS:
        signal.signal(each, _end_at_once)
    gc.disable()
    try:
        yield _begin
    finally:
        for each in SIGNALS:
            signal.signal(each, signal.SIG_DFL)


@contextmanager
def _process_of_others() -> Iterator[Callable[[], None]]:
    """The process is somebody else's, and keeps its signals and threads."""
    held = one_blas_thread() if "numpy" in sys.modules else nullcontext()
    with held, started_with_one_thread():  # NumPy reads the environment when it is loaded
        yield lambda: None


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


@contextmanager
def _problems_in_words() -> Iterator[None]:
    """What is refused or stopped inside the block ends the program, in a line on stderr."""
    try:
        yield
    except OSError as problem:  # such as a full disk, or a folder that vanished
        where = f"{problem.filename}: " if problem.filename else ""
        _refuse(f"{where}{problem.strerror or problem}{_notes(problem)}")
    except (StoppedError, ClientEndedError) as problem:
        print(f"cdpr: {plain_words(str(problem))}", file=sys.stderr)
        sys.exit(INTERRUPTED if isinstance(problem, StoppedError) else problem.exit_code)
    except CdprError as problem:
        _refuse(f"{problem}{_notes(problem)}")
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
