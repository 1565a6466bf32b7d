"""A run whose program is killed goes on from its checkpoint, to the same bytes."""

import json
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from cdpr_drake.analyses.reporting.log_on_disk import CHECKPOINT, PARTS
from cdpr_drake.analyses.simulation import log_keeper
from cdpr_drake.analyses.simulation import run_loop as loop
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS
from cdpr_drake.cli.app import main
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_kind
from tests.analyses.simulation.resumed_runs import assert_it_goes_on_to_the_same_bytes
from tests.cli.test_cli import refuse, run

RUN = ("simulate", "acrobot_mobile_robot", "--log-rate", "25")
LENGTH = ("--duration", "2.0")
KILLED_AT = 1.2
"""Simulated time at which a program ends [s]."""


NO_PICTURES = ("cdpr_drake.analyses.front.simulation.write_pictures", lambda *_: {})
"""They take most of the time, and are made of the log that is compared here."""


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(log_keeper, "CHECKPOINT_WAIT", 0.0)
    monkeypatch.setattr(*NO_PICTURES)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Results of the run that nobody ended."""
    folder = tmp_path_factory.mktemp("undisturbed") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(*NO_PICTURES)
        with pytest.raises(SystemExit) as ended:
            main([*RUN, *LENGTH, "--out", str(folder)])
    assert ended.value.code == 0
    return folder


def same_files(one, other):
    """All data of two runs, but for what tells how long they took."""
    names = sorted(path.name for path in one.iterdir() if path.is_file())
    assert names == sorted(path.name for path in other.iterdir() if path.is_file())
    assert {"log.npz", "log.csv", "scenario.yaml", "summary.json"} < set(names)
    for name in names:
        if name != "summary.json":
            assert (one / name).read_bytes() == (other / name).read_bytes(), name
    summaries = [json.loads((folder / "summary.json").read_text()) for folder in (one, other)]
    for summary in summaries:
        assert summary.pop("wall_time_s") > 0.0
        assert summary.pop("realtime_factor") > 0.0
    assert summaries[0] == summaries[1]


def test_a_run_that_is_killed_comes_to_the_same_bytes(capsys, tmp_path, undisturbed):
    wait = "from cdpr_drake.analyses.simulation import log_keeper; log_keeper.CHECKPOINT_WAIT = 0.0"
    cli = "from cdpr_drake.cli.app import main; import sys; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", f"{wait}\n{cli}", *RUN, *LENGTH, "--out", "out"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        while not any(tmp_path.glob(f".out-work-*/{PARTS}/{CHECKPOINT}")):
            time.sleep(0.02)
            assert process.poll() is None
        process.send_signal(signal.SIGKILL)
    assert not (tmp_path / "out").exists()
    code, out, _ = run(capsys, "simulate", "--continue", "out")
    assert code == 0
    assert "results" in out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"]
    assert not (tmp_path / "out" / PARTS).exists()
    same_files(undisturbed, tmp_path / "out")


def interrupt_at(monkeypatch, sim_time):
    """Stops a run as Ctrl-C does."""
    advance = loop.advance

    def stopped(simulator, duration, outcome_after, errors, session, keeper):
        asked = lambda: simulator.get_context().get_time() >= sim_time  # noqa: E731
        session = replace(session, should_stop=asked)
        return advance(simulator, duration, outcome_after, errors, session, keeper)

    monkeypatch.setattr("cdpr_drake.analyses.simulation.visual_servo_run.advance", stopped)


def test_a_run_that_is_interrupted_goes_on_in_its_folder(
    capsys, tmp_path, monkeypatch, undisturbed
):
    with monkeypatch.context() as patch:
        interrupt_at(patch, KILLED_AT)
        code, _, err = run(capsys, *RUN, *LENGTH, "--out", "out")
    assert code == 130
    assert "cdpr simulate --continue out" in err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"

    # What is there is changed: refused in one line, and nothing is lost.
    scenario = tmp_path / "out" / "scenario.yaml"
    words = scenario.read_text()
    scenario.write_text(words.replace("lambda_slope: 30.0", "lambda_slope: 29.0"))
    said = refuse(capsys, "simulate", "--continue", "out")
    assert "controller.lambda_slope is 30.0 there, 29.0 here" in said
    scenario.write_text(words)
    assert run(capsys, "simulate", "--continue", "out")[0] == 0
    same_files(undisturbed, tmp_path / "out")


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("acrobot_computed_torque", ()),
        (
            "acrobot_friction",
            ("integration.engine=plant", "camera.kind=projected", "winches.mode=position"),
        ),
        ("acrobot_sensors", ("camera.kind=projected", "estimator.kind=fusion")),
        ("acrobot_mobile_robot", ("integration.loop=compiled", "tension_management.rate=512")),
        (
            "acrobot_sensors",
            (
                "integration.loop=compiled",
                "camera.kind=projected",
                "camera.latency_frames=1",
                "estimator.kind=fusion",
                "sensors.log=[tension, encoder, tracker]",
            ),
        ),
    ],
)
def test_other_runs_go_on_too(tmp_path, scenario, changes):
    kind = SCENARIO_KINDS[scenario_kind(scenario)]
    wanted = load_scenario(scenario, [*changes, "duration=0.5"])
    assert_it_goes_on_to_the_same_bytes(kind, wanted, tmp_path)


def test_what_cannot_go_on_is_refused(capsys, tmp_path, monkeypatch):
    assert "holds no log" in refuse(capsys, "simulate", "--continue", "nothing")
    assert "not there" in refuse(capsys, "simulate", "--continue", "no/such/folder")
    both = refuse(capsys, "simulate", "--continue", "a", "--finish", "a")
    assert "--finish: accepted with" in both
    assert "--continue: accepted with" in refuse(capsys, *RUN, "--continue", "a")
    interrupt_at(monkeypatch, 0.2)
    assert run(capsys, *RUN, "--duration", "0.5", "--out", "out")[0] == 130
    parts = tmp_path / "out" / PARTS
    rows = (parts / "time.f8").read_bytes()
    (parts / "time.f8").write_bytes(rows[:16])
    assert "found 2 rows of the log" in refuse(capsys, "simulate", "--continue", "out")
    (parts / "time.f8").write_bytes(rows)
    (parts / CHECKPOINT).write_bytes(b"no")
    assert "no checkpoint that can be read" in refuse(capsys, "simulate", "--continue", "out")
    (parts / CHECKPOINT).unlink()
    assert "holds no checkpoint" in refuse(capsys, "simulate", "--continue", "out")
    assert run(capsys, "simulate", "--finish", "out")[0] == 0
