"""A study is a room and a row of the catalogue: its command, help and folder come from there."""

import json
from dataclasses import dataclass

import pytest
from rich.table import Table

from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.cli.app import main
from tests.messages import printed


@dataclass(frozen=True)
class ToyResult:
    quick: bool
    interrupted: bool = False

    def as_dict(self):
        return {"study": "toy", "quick": self.quick}

    def tables(self):
        return [Table("toy table")]

    def write(self, folder, formats):
        folder.mkdir(exist_ok=True)
        (folder / "results.json").write_text(json.dumps(self.as_dict()))


def study_toy(quick, session):
    return ToyResult(quick, session.should_stop())


def run(capsys, *arguments):
    """Exit code and stdout of `cdpr study`."""
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    return ended.value.code, printed(capsys).out


def test_a_row_of_the_catalogue_is_a_study(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "400")
    assert run(capsys, "toy", "--out", str(tmp_path / "none"))[0] == 2
    monkeypatch.setitem(STUDIES, "toy", StudyEntry(study_toy))
    code, out = run(capsys, "toy", "--quick", "--json", "--out", str(tmp_path / "toy"))
    assert (code, json.loads(out)) == (0, {"study": "toy", "quick": True})
    assert json.loads((tmp_path / "toy" / "results.json").read_text())["quick"]
    code, out = run(capsys, "toy", "--out", str(tmp_path / "other"))
    assert code == 0
    assert "toy table" in out
    words = run(capsys, "--help")[1]
    assert "toy." in words  # the last name of the list
