"""Without a terminal, progress is a line now and then."""

from io import StringIO

from rich.console import Console

from cdpr_drake.cli import terminal


def test_lines_in_the_place_of_a_bar(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "LINE_PERIOD", 0.0)
    with terminal.progress_bar(Console(file=StringIO())) as bar:
        task = bar.add_task("sweep", total=4, state="starting")
        bar.update(task, completed=1, state="3 poses/s")
    assert capsys.readouterr().err == "sweep:  25 %, 3 poses/s\n"


def test_nothing_is_said_of_what_is_quick(capsys):
    with terminal.progress_bar(Console(file=StringIO())) as bar:
        bar.update(bar.add_task("sweep", total=4, state="starting"), completed=4, state="done")
    assert capsys.readouterr().err == ""
