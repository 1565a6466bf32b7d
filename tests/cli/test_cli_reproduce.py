"""`cdpr reproduce` with three cheap studies, as they are."""

from __future__ import annotations

import json

import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION, MET_FITTED
from cdpr_drake.cli.app import main
from tests.messages import printed

NAMES = ("case-8", "case-4", "worked-examples")

ASKED = ("--quick", "--only", ",".join(NAMES), "--workers", "1")


def reproduce(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(["reproduce", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


def test_three_studies_and_again(capsys, tmp_path):
    folder = tmp_path / "r"
    code, out, err = reproduce(capsys, *ASKED, "--out", str(folder), "--json")
    assert code == 0
    found = json.loads(out)
    assert [state["status"] for state in found["studies"]] == ["finished"] * 3
    mine = [item for item in found["items"] if set(item["studies"]) & set(NAMES)]
    judged = {"confirmed", "in part", "not confirmed", "not testable", "shown"}
    judged |= {MET_CONSTRUCTION, MET_FITTED}
    assert {item["verdict"] for item in mine} - {"not judged"} <= judged  # the quick form judges
    assert "missing" not in found["scorecard"]["all"]
    assert json.loads((folder / "summary.json").read_text()) == found
    page = (folder / "report.html").read_text()
    drawn = {(item["source"], path) for item in found["items"] for path in item["figures"]}
    assert page.count("<figure id=") == len(drawn)  # once for each thesis that has it
    for name in NAMES:
        assert (folder / "studies" / name / "results.json").is_file()
    code, out, err = reproduce(capsys, *ASKED, "--out", str(folder))
    assert code == 0
    assert err.count("finished before by the same code, taken over") == 3
    assert "3 studies, report:" in out
    code, _, err = reproduce(capsys, "--only", "case-8", "--out", str(folder))
    assert code == 2
    assert "holds a reproduction in the quick form, the full form is asked for" in err


def test_a_study_that_fails_is_named_and_so_is_the_exit_code(capsys, monkeypatch, tmp_path):
    def broken(quick, session):
        raise RuntimeError("no such thing")

    monkeypatch.setitem(STUDIES, "case-8", StudyEntry(broken))
    code, out, err = reproduce(capsys, "--only", "case-8", "--out", str(tmp_path / "r"))
    assert code == 5
    assert "cdpr: study failed: case-8: RuntimeError: no such thing" in err
    assert "study failed" in out


@pytest.mark.parametrize(
    ("only", "words"), [("case-88", "study 'case-88' is unknown; did you mean"), (",", "accepted")]
)
def test_wrong_names_are_refused_before_anything_is_written(capsys, tmp_path, only, words):
    code, _, err = reproduce(capsys, "--only", only, "--out", str(tmp_path / "r"))
    assert code == 2
    assert words in err
    assert list(tmp_path.iterdir()) == []
