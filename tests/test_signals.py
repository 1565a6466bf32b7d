"""A few signals at random instants; `python -m tests.signals` sends hundreds."""

import json
import signal
import subprocess
import sys

import pytest

from cdpr_drake.analyses.frame.folder import Folder
from tests import signals
from tests.left_files import Reference, broken_files, unknown_files
from tests.signals import COMMANDS, ROOT


def test_a_command_that_a_signal_ends_leaves_what_is_whole():
    """Three signals to the cheapest command; time limits end what hangs, and measure nothing."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.signals", "--count", "1", "--only", "calibrate"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 signals hit, 0 failures" in done.stdout


def test_a_trial_in_the_background_still_interrupts_its_commands(tmp_path, monkeypatch):
    """A shell lets it ignore Ctrl-C, which commands inherit."""
    monkeypatch.setattr(signals, "write_inputs", lambda _: None)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        signals.main(["--only", "", "--keep", str(tmp_path)])
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_all_commands_that_keep_their_work_are_there():
    first = {name: command.words[0] for name, command in COMMANDS.items()}
    assert set(first.values()) == {
        "simulate", "workspace", "plan", "calibrate", "identify", "study", "reproduce", "design",
        "serve",
    }  # fmt: skip
    assert COMMANDS["studio"].studio
    assert COMMANDS["serve"].client


BROKEN = {
    "a.csv": b"x,y\n1,2\n3",
    "b.csv": b"x,y\n1,2",
    "a.json": b'{"squares": [0.',
    "a.npz": b"PK\x03\x04 and no more",
    "a.png": b"\x89PNG and no more",
    "a.pdf": b"%PDF-1.4 and no more",
    "a.html": b"<!doctype html><body>",
    "a.yaml": b"mass: 1",
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_that_is_not_whole_is_seen(tmp_path, name):
    (tmp_path / name).write_bytes(BROKEN[name])
    assert [words.split(" ")[0] for words in broken_files(tmp_path)] == [name]
    (tmp_path / name).rename(tmp_path / f".part-abcdefgh-{name}")  # no final name
    assert list(broken_files(tmp_path)) == []


def test_a_file_that_no_list_has_is_seen(tmp_path):
    out = tmp_path / "out"
    with Folder(out, {}) as results:
        results.write_text("a.csv", "x\n1\n")
        (out / "b.csv").write_text("x\n1\n")  # by who forgot to say so
    assert [words.split(" ")[0] for words in unknown_files(tmp_path)] == ["out/b.csv"]


def test_other_bytes_and_missing_files_are_seen(tmp_path):
    for name, seconds in (("one", 1), ("two", 2), ("three", 3)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.csv").write_text("x\n1\n")
        (tmp_path / name / "s.json").write_text(f'{{"wall_time_s": {seconds}, "mass": 1}}')
    reference, third = Reference(tmp_path / "one", tmp_path / "two"), tmp_path / "three"
    assert list(reference.differs(third, whole=True)) == []
    (third / "a.csv").write_text("x\n2\n")
    (third / "s.json").write_text('{"wall_time_s": 3, "mass": 2}')
    assert list(reference.differs(third, whole=True)) == [
        "a.csv has other bytes", "s.json says other things: ['/mass']"
    ]  # fmt: skip
    (third / "a.csv").unlink()
    assert list(reference.differs(third, whole=False)) == []
    assert "files missing: ['a.csv']" in next(reference.differs(third, whole=True))


def test_times_and_earlier_sessions_are_no_results(tmp_path):
    """Though both runs that nobody ended say the same of them, as the first sessions do."""

    def left(name, *, earlier=0, micros="5.3", solved="31"):
        (tmp_path / name).mkdir()
        table = {"columns": ["solved", "processor time [us]"], "rows": [[solved, micros]]}
        content = {"poses": {"of": 7, "by_earlier_sessions": earlier}, "tables": [table]}
        (tmp_path / name / "s.json").write_text(json.dumps(content))
        return tmp_path / name

    reference = Reference(left("one"), left("two"))
    assert list(reference.differs(left("three", earlier=4, micros="6.1"), whole=True)) == []
    assert list(reference.differs(left("four", solved="30"), whole=True)) == [
        "s.json says other things: ['/tables/0/rows/0/solved (0)']"
    ]
