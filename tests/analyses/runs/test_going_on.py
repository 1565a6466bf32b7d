"""Runs of every kind that are killed half way go on to the same bytes."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs import KINDS, log
from cdpr_drake.errors import CheckpointError, OutputFolderError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

PROJECTED = "camera.kind=projected"


class EndedError(Exception):
    """The program ends."""


def begun(scenario, folder, until=0.15):
    """A run whose program ends once its simulated time [s] is over a limit."""

    def end(progress):
        if progress.done > until:
            raise EndedError

    with pytest.raises(EndedError):
        KINDS[scenario.kind](scenario).simulate(folder, Follow(end))


@pytest.fixture(autouse=True)
def always_checkpoints(monkeypatch):
    monkeypatch.setattr(log, "CHECKPOINT_WAIT", 0.0)


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("acrobot_computed_torque", ()),
        ("acrobot_computed_torque", ("integration.engine=plant",)),
        ("acrobot_friction", ("integration.engine=plant", PROJECTED, "winches.mode=position")),
        ("acrobot_sensors", (PROJECTED, "estimator.kind=fusion")),
        ("acrobot_mobile_robot", ("integration.loop=compiled", "tension_management.rate=512")),
        ("acrobot_sensors", (
            "integration.loop=compiled", PROJECTED, "camera.latency_frames=1",
            "estimator.kind=fusion", "sensors.log=[tension, encoder, tracker]",
        )),
        ("acrobot_switching", (
            "integration.loop=compiled", PROJECTED, "estimator.compare=[first_image]",
        )),
        ("acrobot_slack_start_tca", (
            "integration.loop=compiled", PROJECTED, "sensors.log=[tension]",
        )),
        ("acrobot_pick_and_place", (PROJECTED,)),
        ("cable_arm_computed_torque", ()),
        ("mobile_bases_winches", ()),
    ],
)  # fmt: skip
def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path, scenario, changes):
    loaded = load_scenario(scenario, [*changes, "duration=0.3"])
    whole = KINDS[loaded.kind](loaded).simulate()
    begun(loaded, tmp_path)
    again = KINDS[loaded.kind](loaded).simulate(tmp_path)
    assert (again.outcome, again.sim_time) == (whole.outcome, whole.sim_time)
    assert list(again.log) == list(whole.log)
    for quantity, values in whole.log.items():
        assert again.log[quantity].tobytes() == values.tobytes(), quantity


def test_an_interruption_keeps_a_checkpoint_at_that_step(tmp_path, monkeypatch):
    monkeypatch.setattr(log, "CHECKPOINT_WAIT", np.inf)
    loaded = load_scenario("planar_pbvs", [PROJECTED, "duration=0.3"])
    run = KINDS[loaded.kind](loaded)
    stopped = run.simulate(tmp_path, Follow(stop=lambda: True))
    assert (stopped.outcome, stopped.sim_time) == (Outcome.INTERRUPTED, 0.1)
    times = []
    again = KINDS[loaded.kind](loaded)
    again.simulate(tmp_path, Follow(lambda progress: times.append(progress.done)))
    assert times[0] == pytest.approx(0.2)
    assert again.outcome == Outcome.TIMEOUT


def test_what_a_killed_run_left_is_read_as_far_as_it_is_whole_and_refused_where_it_is_not(tmp_path):
    loaded = load_scenario("planar_pbvs", [PROJECTED, "duration=0.3"])
    other = load_scenario("acrobot_pbvs", [PROJECTED, "duration=0.3"])
    begun(loaded, tmp_path)
    parts, kind = tmp_path / log.PARTS, KINDS[loaded.kind]
    rows = log.DiskLog(parts).rows
    with (parts / "X_WP.f8").open("ab") as file:
        file.write(b"part of a row")
    run = kind(loaded).recover(tmp_path)
    assert len(run.log["X_WP"]) == len(run.log["time"]) == rows > 1
    assert run.as_dict()["message"] == "the program ended before the run did"
    np.testing.assert_array_equal(log.log_block(run.log, "X_WP", 1, 3), run.log["X_WP"][1:3])
    assert run.columns()["X_WP.z_m"][-1] == run.log["X_WP"][-1, 6]
    with pytest.raises(CheckpointError, match=r"checkpoint.npz: cannot be used"):
        kind(other).simulate(tmp_path)
    (parts / "time.f8").write_bytes(b"")
    with pytest.raises(CheckpointError, match="found 0 rows of the log; accepted: the"):
        kind(loaded).simulate(tmp_path)
    (parts / log.CHECKPOINT).write_bytes(b"half")
    with pytest.raises(CheckpointError, match=r"cannot be used.*add overwrite"):
        kind(loaded).simulate(tmp_path)
    (parts / log.LAYOUT).write_text("half")
    with pytest.raises(OutputFolderError, match="no log that can be read"):
        kind(loaded).recover(tmp_path)


def test_a_log_that_grows_beyond_memory_is_the_same(tmp_path, monkeypatch):
    loaded = load_scenario("planar_computed_torque", ["duration=0.3", "log_rate=200"])
    whole = KINDS[loaded.kind](loaded).simulate()
    monkeypatch.setattr(log, "MOST_ROWS", 7)
    grown = KINDS[loaded.kind](replace(loaded)).simulate(tmp_path)
    assert isinstance(grown.log, log.DiskLog)
    for quantity, values in whole.log.items():
        np.testing.assert_array_equal(grown.log[quantity], values)
