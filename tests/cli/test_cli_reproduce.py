"""`cdpr reproduce` with two cheap studies, as they are."""

from __future__ import annotations

import json

import pytest

from cdpr_drake.analyses.front import reproduction
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.reproduction import digest_pdf
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION, MET_FITTED
from cdpr_drake.cli.app import main
from tests.messages import printed

NAMES = ("case-8", "worked-examples")

ASKED = ("--quick", "--only", ",".join(NAMES), "--workers", "1")


def reproduce(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(["reproduce", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


def test_two_studies_and_again(capsys, tmp_path):
    folder = tmp_path / "r"
    code, out, err = reproduce(capsys, *ASKED, "--out", str(folder), "--json")
    assert code == 0
    found = json.loads(out)
    assert [state["status"] for state in found["studies"]] == ["finished"] * 2
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
    code, out, err = reproduce(capsys, *ASKED, "--out", str(folder), "--beside", str(folder))
    assert code == 0
    assert err.count("finished before by the same code, taken over") == 2
    assert "2 studies, report:" in out
    assert "digest:" in out
    assert (folder / "digest.pdf").read_bytes().startswith(b"%PDF-")
    assert "<small>was" not in page
    assert "0 facts have another verdict, 0 are new, 0 are" in (folder / "report.html").read_text()
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


def test_an_older_report_that_is_none_is_refused_before_anything_is_written(capsys, tmp_path):
    (tmp_path / "old").mkdir()
    code, _, err = reproduce(
        capsys, "--out", str(tmp_path / "r"), "--beside", str(tmp_path / "old")
    )
    assert code == 2
    assert "summary.json: cannot be read: No such file" in err
    assert not (tmp_path / "r").exists()


class Nothing:
    """A study that finds nothing at once."""

    interrupted = False

    def as_dict(self):
        return {"statements": []}

    def tables(self):
        return []

    def write(self, folder, formats):
        write_json(folder / "results.json", self.as_dict())


def nothing(quick, session):
    return Nothing()


def test_without_reportlab_the_rest_is_there_and_a_line_says_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(digest_pdf, "find_spec", lambda name: None)
    monkeypatch.setitem(STUDIES, "case-8", StudyEntry(nothing))
    code, _, err = reproduce(capsys, "--only", "case-8", "--out", str(tmp_path / "r"))
    assert code == 0
    words = "digest.pdf was not written: reportlab is not installed: pip install 'cdpr_drake"
    assert err.count(words) == 1
    assert (tmp_path / "r" / "report.html").is_file()
    assert not (tmp_path / "r" / "digest.pdf").exists()


def test_a_digest_that_fails_is_named_and_the_rest_is_there(capsys, monkeypatch, tmp_path):
    def full(path, story):
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(STUDIES, "case-8", StudyEntry(nothing))
    asked = ("--only", "case-8", "--out", str(tmp_path / "r"))
    with monkeypatch.context() as patch:
        patch.setattr(reproduction, "write_digest", full)
        code, _, err = reproduce(capsys, *asked)
    assert code == 3
    assert "cdpr: digest.pdf was not written: [Errno 28] No space left on device" in err
    assert (tmp_path / "r" / "report.html").is_file()
    assert (tmp_path / "r" / "summary.json").is_file()
    assert not list((tmp_path / "r").glob("*digest*"))
    assert reproduce(capsys, *asked)[0] == 0
    assert (tmp_path / "r" / "digest.pdf").is_file()
    with monkeypatch.context() as patch:
        patch.setattr(reproduction, "write_digest", full)
        _, _, err = reproduce(capsys, *asked)
    assert "(the one that is there is of an earlier report)" in err
