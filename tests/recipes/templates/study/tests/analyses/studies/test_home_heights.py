"""The toy study's quick form, by the front door and by the command."""

import json

import pytest

import cdpr_drake as cdpr
from cdpr_drake.cli.app import main
from tests.messages import printed


def run(capsys, *arguments):
    """Exit code and stdout of `cdpr study`."""
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    return ended.value.code, printed(capsys).out


def test_the_command_knows_it(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "400")
    out = tmp_path / "heights"
    code, words = run(capsys, "home-heights", "--quick", "--json", "--out", str(out))
    height = float(cdpr.load_robot("acrobot_large").home.transform().translation()[2])
    told = json.loads(words)
    assert (code, told["runs"]) == (
        0, [{"robot": "acrobot_large", "height_m": height}],
    )  # fmt: skip
    assert told["statements"][0]["verdict"] == "confirmed"
    assert json.loads((out / "results.json").read_text()) == told
    assert (out / "heights.png").exists()
    code, words = run(capsys, "home-heights", "--out", str(tmp_path / "other"))
    assert code == 0
    assert "caroca" in words
    assert "home-heights" in run(capsys, "--help")[1]


def test_the_front_door_knows_it():
    assert "home-heights" in cdpr.studies()
    assert cdpr.run_study("home-heights", quick=True).as_dict()["units"] == {"height_m": "m"}
