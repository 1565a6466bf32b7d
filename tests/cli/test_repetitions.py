"""`cdpr simulate --seeds`: what it accepts, writes and says."""

import json
import re
import subprocess
import sys
import time

import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.cli.simulate import parse_seeds
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from tests.messages import printed


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main(["simulate", *arguments])
    captured = printed(capsys)
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
    folders = list((tmp_path / "runs").iterdir())
    assert [folder.name.startswith("acrobot_pbvs_taut-") for folder in folders] == [True]
    assert (folders[0] / "runs.csv").is_file()


def test_finished_runs_are_found_again_and_other_seeds_can_follow(capsys, tmp_path):
    short = ("--camera", "projected", "--workers", "1", "--json", "--out", "out")

    def repeat(seeds, duration="0.2", *more):
        code, out, err = run(capsys, *short, "--seeds", seeds, "--duration", duration, *more)
        return code, json.loads(out)["runs"] if out else None, err

    _, first, said = repeat("0:2")
    assert said.splitlines() == [
        f"{DEFAULT_SCENARIO}: by the compiled loop (its events in Python, since its tensions are "
        "managed), as the run is repeated; else with --set integration.loop=diagram"
    ]
    assert {(run["engine"], run["loop"]) for run in first} == {("compiled", "compiled")}
    _, again, said = repeat("0:2")
    assert "complete already" in said
    assert again == first  # times included: nothing was computed
    _, more, said = repeat("1:4")
    assert "Continuing in out: 1 of 3 runs were there already" in said
    assert [one["seed"] for one in more] == [1, 2, 3]
    assert more[0] == first[1]
    code, _, said = repeat("0:2", "0.3")
    assert code == 2
    assert "scenario.duration is 0.2 there, 0.3 here" in said
    assert repeat("0:1", "0.3", "--overwrite")[0] == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"]


def test_another_robot_in_the_same_file_is_another_question(capsys, tmp_path):
    words = robot_file("acrobot_small").read_text()
    (tmp_path / "mine.yaml").write_text(words)
    arguments = (
        "--camera", "projected", "--workers", "1", "--json", "--out", "out", "--seeds", "0",
        "--duration", "0.1", "--set", f"robot={tmp_path / 'mine.yaml'}",
    )  # fmt: skip
    assert run(capsys, *arguments)[0] == 0
    mass = re.search(r"mass: ([\d.]+)", words)
    (tmp_path / "mine.yaml").write_text(words.replace(mass[0], f"mass: {1.01 * float(mass[1])}"))
    code, _, err = run(capsys, *arguments)
    assert code == 2
    assert "results of other arguments: robot." in err


def test_a_killed_repetition_continues(capsys, tmp_path):
    """Whatever ends the program, seeds that were finished are not done again."""
    options = [
        "--camera", "projected", "--duration", "0.4", "--seeds", "0:60", "--workers", "1",
        "--out", "out", "--json",
    ]  # fmt: skip
    command = [sys.executable, "-m", "cdpr_drake", "simulate", *options]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        while len(list(tmp_path.glob("out/chunks/seed-*.npz"))) < 2:
            time.sleep(0.05)
            assert process.poll() is None
        process.kill()
        process.wait()
    kept = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("out/chunks/seed-*.npz")}
    assert 2 <= len(kept) < 60
    options[options.index("0:60")] = f"0:{len(kept) + 1}"
    code, out, err = run(capsys, *options)
    assert code == 0
    assert f"Continuing in out: {len(kept)} of {len(kept) + 1} runs were there already" in err
    assert len(json.loads(out)["runs"]) == len(kept) + 1
    for name, when in kept.items():
        assert (tmp_path / "out" / "chunks" / name).stat().st_mtime_ns == when


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


def test_a_folder_that_is_refused_is_all_that_is_said(capsys, tmp_path):
    quick = ("--camera", "projected", "--duration", "0.1", "--seeds", "1", "--workers", "1")
    code, _, err = run(capsys, *quick, "--out", ".")
    assert code == 2
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())
