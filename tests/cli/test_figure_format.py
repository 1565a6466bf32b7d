"""`--format`: which files figures become, refused before anything runs."""

import os

import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.cli.app import main
from cdpr_drake.cli.options import parse_formats
from cdpr_drake.cli.study import _command
from cdpr_drake.errors import CdprError
from tests.messages import printed


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def run(capsys, *arguments):
    """Exit code and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code, printed(capsys).err


@pytest.mark.parametrize(
    ("words", "formats"),
    [
        ("png", ("png",)),
        ("pdf,svg", ("pdf", "svg")),
        ("svg, PDF", ("svg", "pdf")),
        ("png,png", ("png",)),
    ],
)
def test_formats_are_accepted_alone_and_together(words, formats):
    assert parse_formats(words) == formats


@pytest.mark.parametrize("words", ["", "jpg", "png,", "png pdf", "../png", "png,eps"])
def test_others_are_refused_with_what_is_accepted(words):
    with pytest.raises(CdprError, match=r"--format: found '.*'; accepted: png, pdf, svg"):
        parse_formats(words)


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "--camera", "projected"],
        ["simulate", "--camera", "projected", "--seeds", "0:2"],
        ["simulate", "acrobot_computed_torque"],
        ["study", "case-1", "--quick"],
        ["stability", "acrobot_large", "--grid", "2,2,2"],
    ],
)
def test_a_bad_format_is_refused_before_anything_runs(capsys, tmp_path, command):
    code, err = run(capsys, *command, "--out", "there", "--format", "pgn")
    assert code == 2
    assert err.strip().splitlines() == [
        "cdpr: --format: found 'pgn'; accepted: png, pdf, svg, or several with commas"
    ]
    assert os.listdir(tmp_path) == []


def test_simulate_writes_the_formats_asked_for(capsys, tmp_path):
    words = ["simulate", "planar_pbvs", "--camera", "projected", "--duration", "0.2"]
    assert run(capsys, *words, "--out", "o", "--format", "pdf,svg")[0] == 0
    names = os.listdir(tmp_path / "o")
    figures = {name for name in names if name.rpartition(".")[2] in ("png", "pdf", "svg")}
    assert {"tensions.pdf", "tensions.svg", "error.pdf", "platform_path.svg"} <= figures
    assert not [name for name in figures if name.endswith(".png")]
    assert "replay.html" in names


def test_stability_writes_the_formats_asked_for(capsys, tmp_path):
    words = ["stability", "acrobot_large", "--grid", "2,2,2", "--verdict", "sampled"]
    words += ["--draws", "1", "--workers", "1", "--out", "o", "--format", "svg"]
    assert run(capsys, *words)[0] == 0
    names = os.listdir(tmp_path / "o")
    assert {"planes.svg", "solids.svg"} <= set(names)
    assert not [name for name in names if name.endswith(".png")]


def test_a_study_hands_the_formats_to_its_result(capsys, monkeypatch):
    asked = []

    class Result:
        interrupted = False

        def as_dict(self):
            return {}

        def tables(self):
            return []

        def write(self, folder, formats):
            asked.append(tuple(formats))

    monkeypatch.setitem(STUDIES, "toy", StudyEntry(lambda quick, session: Result()))
    assert run(capsys, "study", "toy", "--out", "o", "--format", "pdf,png")[0] == 0
    assert asked == [("pdf", "png")]


def test_the_command_that_continues_a_study_keeps_the_formats():
    words = _command("toy", "o", True, False, ("pdf", "svg"))
    assert words == "cdpr study toy --out o --quick --format pdf,svg"
    assert "--format" not in _command("toy", "o", True, False, ("png",))
