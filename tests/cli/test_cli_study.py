"""`cdpr study` for studies that continue: what is said, kept, found again and refused."""

import json
import shlex
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.control_stability import study as module
from cdpr_drake.analyses.studies.published.stability_tables import TABLES
from cdpr_drake.cli.app import main
from cdpr_drake.cli.process import StopRequest
from tests.cli.killed import killed_after
from tests.messages import printed

CHUNK = 20
"""Poses per chunk, so that a short study has many."""

STOPPED_AFTER = 7
"""Chunks of the first session."""


BOUNDS = ("r_bp", "r_pc")
"""Bounds whose rows are repeated."""


FEW = 2
"""Pieces of a certificate at most: most of such a study's work, of which nothing is asked here."""


def short(table):
    """A published table with few rows."""
    return replace(table, rows={name: table.rows[name] for name in BOUNDS})


SHORT = replace(module.STUDY, chunk=CHUNK)


def shorten(monkeypatch):
    monkeypatch.setattr(module, "TABLES", [short(TABLES[0])])
    monkeypatch.setattr(module, "QUICK_PIECES", FEW)
    entry = replace(STUDIES["control-stability"], run=SHORT)
    monkeypatch.setitem(STUDIES, "control-stability", entry)


@pytest.fixture(autouse=True)
def _short(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shorten(monkeypatch)


@pytest.fixture(scope="module")
def whole():
    """Rows of the study in one go."""
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        found = SHORT(quick=True, session=StudySession(workers=1))
    return json.loads(json.dumps(found.as_dict()["runs"]))


def study(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


def interrupted(capsys, monkeypatch, *arguments):
    """The same, where Ctrl-C comes after some chunks."""
    asked = iter(range(STOPPED_AFTER))
    with monkeypatch.context() as patch:
        patch.setattr(StopRequest, "__call__", lambda self: next(asked, None) is None)
        return study(capsys, *arguments)


def test_an_interrupted_study_names_the_command_that_continues_it(
    capsys, monkeypatch, tmp_path, whole
):
    code, out, err = interrupted(capsys, monkeypatch, "control-stability", "--quick", "--json")
    assert code == 130
    assert json.loads(out)["interrupted"]
    command = shlex.split(err.strip().splitlines()[-1])
    assert command[:3] == ["cdpr", "study", "control-stability"]
    assert (tmp_path / "studies" / "control-stability" / "results.json").exists()
    code, out, err = study(capsys, *command[2:])
    assert code == 0
    total = json.loads(out)["poses"]["of"]
    found = STOPPED_AFTER * CHUNK
    # A row has 81 poses, so every fifth chunk has one pose.
    found -= (STOPPED_AFTER // 5) * (CHUNK - 1)
    assert f"{found} of {total} poses were there already" in err
    assert json.loads(out)["runs"] == whole
    code, again, err = study(capsys, *command[2:])
    assert "complete already, nothing was computed" in err
    assert json.loads(again)["runs"] == json.loads(out)["runs"]


def test_other_arguments_are_refused_and_overwrite_begins_anew(capsys, monkeypatch, tmp_path):
    asked = ("control-stability", "--out", "a [b]")
    interrupted(capsys, monkeypatch, *asked, "--quick")
    kept = sorted(path.name for path in (tmp_path / "a [b]" / "chunks").iterdir())
    assert len(kept) == STOPPED_AFTER
    code, _, err = study(capsys, *asked)
    assert code == 2
    assert "quick is true there, false here" in err
    assert len(err.strip().splitlines()) == 1
    assert sorted(path.name for path in (tmp_path / "a [b]" / "chunks").iterdir()) == kept
    _, _, err = interrupted(capsys, monkeypatch, *asked, "--quick", "--overwrite")
    assert "were there already" not in err
    assert shlex.split(err.strip().splitlines()[-1]) == ["cdpr", "study", *asked, "--quick"]
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("x")
    code, _, err = study(capsys, "control-stability", "--quick", "--out", "other")
    assert (code, (tmp_path / "other" / "thesis.txt").exists()) == (2, True)
    assert "holds files already" in err


KILLED = killed_after(
    STOPPED_AFTER,
    f"""
from dataclasses import replace
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.control_stability import study as module
table = module.TABLES[0]
module.TABLES = [replace(table, rows={{name: table.rows[name] for name in {BOUNDS}}})]
module.QUICK_PIECES = {FEW}
entry = STUDIES["control-stability"]
STUDIES["control-stability"] = replace(entry, run=replace(module.STUDY, chunk={CHUNK}))
""",
)


def test_a_killed_study_continues(capsys, tmp_path, whole):
    (tmp_path / "killed.py").write_text(KILLED)
    asked = ["study", "control-stability", "--quick", "--out", "k", "--json"]
    # In one process; workers that are left behind: `test_a_killed_sweep_continues_and_says_so`.
    words = [sys.executable, "killed.py", *asked, "--workers", "1"]
    first = subprocess.run(words, cwd=tmp_path, check=False)
    assert first.returncode == -signal.SIGKILL
    assert not (tmp_path / "k" / "results.json").exists()
    code, out, err = study(capsys, *asked[1:])
    assert code == 0
    assert "poses were there already" in err
    assert json.loads(out)["poses"]["by_earlier_sessions"] >= STOPPED_AFTER
    assert json.loads(out)["runs"] == whole


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("worked-examples", ["tcp://127.0.0.1:9"]),
        ("workspaces", ["tcp://127.0.0.1:9"]),
        ("case-9", ["tcp://127.0.0.1:9"]),
    ],
)
def test_schedulers_are_refused_before_anything_is_written(
    capsys, monkeypatch, tmp_path, name, words
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("cdpr_drake.analyses.sweeps.workers.SCHEDULER_TIMEOUT", 0.3)
    with pytest.raises(SystemExit) as end:
        main(["study", name, "--quick", "--scheduler", "tcp://127.0.0.1:9"])
    assert end.value.code == 2
    said = printed(capsys).err
    assert len(said) <= 500
    for word in words:
        assert word in said
    assert not any(tmp_path.iterdir())
