"""`cdpr import-log`: what it refuses before anything is written, and idle options that it tells."""

import pytest

from cdpr_drake.cli.app import main
from tests.messages import printed

LOG = "time_s,C1_length_m\n0,1\n0.1,1.1\n0.2,1.2\n"


@pytest.fixture
def log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "log.csv"
    path.write_text(LOG)
    (tmp_path / "empty.csv").touch()
    (tmp_path / "folder").mkdir()
    return path


def ended(*words):
    with pytest.raises(SystemExit) as end:
        main(["import-log", *words])
    return end.value.code


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["log.csv", "--out", "log.csv", "--overwrite"], "found log.csv, the log itself"),
        (["log.csv", "--out", "x.csv", "--plot", "x.bmp"], "x.bmp: found the ending .bmp"),
        (["log.csv", "--out", "x.csv", "--plot", "x"], "x: found no ending; accepted: .png"),
        (["log.csv", "--out", "x.csv", "--plot", "no/x.png"], "there is no folder no"),
        (["log.csv", "--out", "x.csv", "--rate", "-5"], "--rate: found -5; accepted: above 0"),
        (["log.csv", "--out", "x.csv", "--rate", "nan"], "--rate: found nan; accepted: above 0"),
        (["log.csv", "--out", "x.csv", "--from", "5"], "found no rows from 5 s; accepted: a part"),
        (["log.csv", "--out", "x.csv", "--unit", "mm"], "accepted: DIMENSION=UNIT, as length=mm"),
        (["log.csv", "--out", "x.csv", "--every", "0"], "--every: found '0'; accepted: at least 1"),
        (["log.csv", "--out", "x.csv", "--every", "few"], "found 'few'; accepted: a whole number"),
        (
            ["log.csv", "--out", "x.csv", "--from", "dawn"],
            "--from: found 'dawn'; accepted: a number",
        ),
        (["empty.csv", "--out", "x.csv"], "empty.csv: found an empty file; accepted: a log"),
        (["folder", "--out", "x.csv"], "folder: found a folder; accepted: a log"),
        (["none.csv", "--out", "x.csv"], "none.csv: found no such file; accepted: a log"),
    ],
)
def test_what_is_refused_writes_nothing(words, said, log, capsys):
    before = sorted(log.parent.iterdir())
    assert ended(*words) == 2
    told = printed(capsys).err.strip()
    assert said in told
    assert told.count("\n") == 0
    assert sorted(log.parent.iterdir()) == before
    assert log.read_text() == LOG


def test_options_that_change_nothing_are_told(log, capsys):
    words = ["log.csv", "--rate", "10", "--body", "P", "--cables", "A,B"]
    assert ended(*words) == 0
    said = printed(capsys).out
    assert "not used: a rate of 10 1/s, since the file has times" in said
    assert "not used: the rigid body P, since only motive files have some" in said
    assert "not used: the cables A, B, since no column is of one" in said
    assert ended("log.csv", "--cables", "C1") == 0
    assert "not used" not in printed(capsys).out


def test_a_rate_is_used_where_there_are_no_times(log, capsys):
    log.write_text(LOG.replace("time_s", "count").replace("count,", "C2_length_m,"))
    assert ended("log.csv", "--rate", "10") == 0
    said = printed(capsys).out
    assert "10 rows/s, as told" in said
    assert "not used" not in said
