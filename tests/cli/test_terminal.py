"""Without a terminal, progress is a line now and then, and tables are as wide as they need."""

import gc
import re
import sys
import time
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numba.core import event
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.cli import compiling as compiling_module
from cdpr_drake.cli import process, terminal
from cdpr_drake.cli.compiling import _compilations, compiling
from cdpr_drake.cli.process import PROGRESS
from cdpr_drake.studio import jobs
from tests.messages import messages, printed


@pytest.fixture(autouse=True)
def _nothing_is_compiled(monkeypatch):
    monkeypatch.setattr(terminal, "FIRST_USE", False)
    monkeypatch.setattr(terminal, "compiling", lambda: "")


def test_lines_in_the_place_of_a_bar(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "LINE_PERIOD", 0.0)
    with terminal.progress_bar(Console(file=StringIO())) as bar:
        task = bar.add_task("sweep", total=4, state="starting")
        bar.update(task, completed=1, state="3 poses/s")
    start, quarter = (
        f"{PROGRESS}sweep: {state}" for state in ("  0 %, starting", " 25 %, 3 poses/s")
    )
    assert {quarter} <= set(capsys.readouterr().err.splitlines()) <= {start, quarter}


def test_nothing_is_said_of_what_is_quick(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "LINE_PERIOD", 3600.0)
    with terminal.progress_bar(Console(file=StringIO())) as bar:
        bar.update(bar.add_task("sweep", total=4, state="starting"), completed=4, state="done")
    with terminal.working(Console(file=StringIO()), "Building"):
        pass
    assert capsys.readouterr().err == ""


def lines_while_silent(capsys, block):
    """What is said of work that reports nothing itself, as soon as anything is."""
    with block:
        said = ""
        while not said:
            time.sleep(0.01)
            said = capsys.readouterr().err
    capsys.readouterr()  # what was said between the last look and the end belongs to this block
    first = said.splitlines()[0]
    assert first.startswith(PROGRESS)
    return first.removeprefix(PROGRESS)


def test_lines_come_while_the_work_says_nothing(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "LINE_PERIOD", 0.0)
    monkeypatch.setattr(terminal, "LOOK_PERIOD", 0.01)
    console = Console(file=StringIO())
    assert lines_while_silent(capsys, terminal.working(console, "Building")) == "Building"
    monkeypatch.setattr(terminal, "compiling", lambda: "compiling, first use, 3 kernels so far")
    words = "Building: compiling, first use, 3 kernels so far"
    assert lines_while_silent(capsys, terminal.working(console, "Building")) == words
    bar = terminal.progress_bar(console)
    bar.add_task("servo", total=4, state="starting")
    words = "servo:   0 %, starting, compiling, first use, 3 kernels so far"
    assert lines_while_silent(capsys, bar) == words


def test_lines_of_progress_are_whole_and_told_from_messages(capsys, monkeypatch):
    """Each is written in one piece: a thread writes it while the command says something else."""
    monkeypatch.setattr(terminal, "LINE_PERIOD", 0.0)
    pieces = []
    written = sys.stderr.write
    monkeypatch.setattr(sys.stderr, "write", lambda words: pieces.append(words) or written(words))
    console = terminal.message_console()
    with terminal.working(console, "Building"):
        console.print("warning: a cable is slack")
    assert [piece for piece in pieces if piece.startswith(PROGRESS)] == [f"{PROGRESS}Building\n"]
    assert printed(capsys).err == "warning: a cable is slack\n"
    assert messages(f"one\n{PROGRESS}a\ntwo, progress: b\n") == "one\ntwo, progress: b\n"


def test_who_reads_progress_knows_its_mark():
    """The studio's server imports nothing of the commands that it starts."""
    assert jobs.PROGRESS == PROGRESS
    assert jobs.PROGRESS_PERIOD == terminal.PROGRESS_PERIOD


def test_no_test_reads_stderr_but_through_messages():
    """A line of progress may come between any others, or be the only one."""
    tests = Path(__file__).parents[1]
    free = {Path(__file__), tests / "messages.py", tests / "test_golden.py"}
    # What lines of progress do not change, or what is only shown where an assertion fails.
    reads = re.compile(r"readouterr\(\)(?!\.out\b)|(?<!messages\()\b\w+\.stderr(?!=)\b")
    shown = re.compile(
        r"assert .* == .*, (\w+\.stdout \+ )?\w+\.stderr$|\" in \w+\.stderr$|print\(|sys\.stderr|"
        r"iter\(|\.close\(\)"
    )
    wrong = [
        f"{path.relative_to(tests)}:{number + 1}: {line.strip()}"
        for path in sorted(tests.rglob("*.py"))
        if path not in free and path.name.startswith("test_")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines())
        if reads.search(line) and not shown.search(line)
    ]
    assert not wrong, "\n".join(wrong)


def test_processes_that_compile_are_told_by_the_empty_cache(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "LINE_PERIOD", 0.0)
    monkeypatch.setattr(terminal, "FIRST_USE", True)
    with terminal.progress_bar(Console(file=StringIO())) as bar:
        task = bar.add_task("seeds", total=4, state="starting processes")
        bar.update(task, completed=0)
        assert "seeds:   0 %, starting processes, compiling, first use" in capsys.readouterr().err
        bar.update(task, completed=1, state="1 of 4 runs")
        assert "compiling" not in capsys.readouterr().err


def test_a_kernel_that_is_compiled_is_noticed(monkeypatch):
    compiling()  # listens from now on
    before = _compilations.count

    @njit
    def twice(x):
        return 2.0 * x

    @njit
    def four_times(x):
        return twice(twice(x))

    four_times(1.0)
    assert _compilations.count == before + 2
    monkeypatch.setattr(compiling_module, "LINGER", np.inf)
    monkeypatch.setattr(process, "_expected", 0)
    assert compiling() == f"compiling, first use, {before + 2} kernels so far"
    monkeypatch.setattr(process, "_expected", before + 9)
    assert compiling() == f"compiling, first use, {before + 2} of up to {before + 9} kernels"


def test_functions_of_numba_are_no_kernels_of_ours():
    compiling()
    before = _compilations.count

    @njit
    def pair():
        return np.zeros(2)

    pair()
    assert _compilations.count == before + 1


def test_nothing_of_a_table_is_cut_in_a_pipe(capsys):
    table = Table(box=SIMPLE_HEAD)
    cables = [f"cable_number_{k}" for k in range(30)]
    for name in cables:
        table.add_column(name, no_wrap=True)
    table.add_row(*["1.23"] * 30)
    terminal.wide_console(80).print(table)
    lines = capsys.readouterr().out.splitlines()
    assert any(all(name in line for name in cables) for line in lines)


def test_a_row_is_a_line_in_a_pipe_until_it_is_very_long(capsys):
    for words, rows in (("to be or not to be, " * 6, 1), ("to be or not to be, " * 30, 3)):
        table = Table(show_header=False, box=None, padding=0)
        table.add_row(words)
        terminal.wide_console(80).print(table)
        assert len(capsys.readouterr().out.splitlines()) == rows


def test_no_subcommand_makes_a_console_of_its_own():
    """A console of rich takes [m] and [bold]x for markup, unless it is told not to."""
    for path in sorted(Path(terminal.__file__).parent.glob("*.py")):
        if path.name != "terminal.py":
            assert "Console(" not in path.read_text(), path.name


@pytest.mark.parametrize("words", ["[bold]x", "length [m]", "[/red]", "a [link=x]b"])
def test_what_users_write_is_never_markup(capsys, words):
    table = Table(title=words)
    table.add_column(words)
    table.add_row(words)
    terminal.wide_console().print(table)
    terminal.message_console().print(words)
    out, err = capsys.readouterr()
    assert out.count(words) == 3
    assert err == f"{words}\n"


def test_garbage_is_not_searched_for_while_kernels_are_compiled():
    compiling()  # begins to listen
    assert gc.isenabled()
    with event.trigger_event("numba:compile", {}):
        with event.trigger_event("numba:compile", {}):
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()
    event.broadcast(event.Event("numba:compile", event.EventStatus.END, {}))  # began before
    with event.trigger_event("numba:compile", {}):
        assert not gc.isenabled()
        assert compiling()
    assert gc.isenabled()
