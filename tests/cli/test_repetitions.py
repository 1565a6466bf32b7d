"""`cdpr simulate --seeds`: what it accepts, writes and says."""

import json

import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.cli.repetitions import parse_seeds
from cdpr_drake.errors import ScenarioError


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main(["simulate", *arguments])
    captured = capsys.readouterr()
    return end.value.code, captured.out, captured.err


@pytest.mark.parametrize(
    ("words", "seeds"), [("0:3", [0, 1, 2]), ("5:6", [5]), ("4", [4]), ("3,5,8", [3, 5, 8])]
)
def test_seeds_as_spans_and_lists(words, seeds):
    assert parse_seeds(words) == seeds


@pytest.mark.parametrize(
    "words", ["", "3:3", "5:2", "1:2:3", "-1:2", "1,1", "a", "1.5", "0:9999999999", "9999999999"]
)
def test_other_seeds_are_refused(words):
    with pytest.raises(ScenarioError, match="accepted: first:end"):
        parse_seeds(words)


def test_it_writes_a_folder_and_prints_json(capsys, tmp_path):
    code, out, _ = run(
        capsys, "--camera", "projected", "--duration", "0.2", "--seeds", "2:4", "--workers", "1",
        "--json",
    )  # fmt: skip
    summary = json.loads(out)
    assert code == 0
    assert summary["seeds"] == [2, 3]
    assert summary["outcomes"] == {"timeout": 2}
    assert [r["seed"] for r in summary["runs"]] == [2, 3]
    assert (tmp_path / "runs" / "acrobot_pbvs" / "runs.csv").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--seeds", "3:1"], "--seeds: found '3:1'; accepted: first:end"),
        (["--seeds", "0:2", "--seed", "3"], "without --seed and --video"),
        (["--seeds", "0:2", "--video"], "without --seed and --video"),
        (["--workers", "2"], "--workers: accepted with --seeds only"),
        (["acrobot_computed_torque", "--seeds", "0:2"], "accepted for visual servos"),
        (["--seeds", "0:2", "--set", "initial_pose.position=[0, 0, 1.1]"], "cannot hold"),
    ],
)
def test_it_refuses_in_one_line_and_leaves_nothing(capsys, tmp_path, arguments, words):
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert words in err
    assert len(err.splitlines()) == 1
    assert not out
    assert not list(tmp_path.iterdir())
