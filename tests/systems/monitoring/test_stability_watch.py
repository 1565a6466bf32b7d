"""The block that follows the stability criterion live, its log signals, and a run's folder."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.log_files import write_log
from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.simulation.run_figures import run_figures
from cdpr_drake.analyses.simulation.run_stability import (
    StabilityAlong,
    run_criterion,
    stability_along,
    turned_criterion,
)
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.stability_files import stability_figure, stability_of_folder
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.cli.app import main
from cdpr_drake.errors import OutputFolderError, ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_watches import criterion_of
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.stability_watch import StabilityWatch
from tests.messages import printed

SAME = 1e-9
"""Two ways to the same margin differ by rounding of the logged quaternions only [-]."""

SHORT = ["camera.kind=projected", "integration.engine=compiled", "duration=1.6"]


@pytest.fixture(scope="module")
def result():
    return run_scenario(load_scenario("acrobot_slack_start", [*SHORT, "stability={threshold: 1}"]))


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    write_log(path, result.log, [f"C{k}" for k in range(1, 9)], result.servo.feature_names)
    write_run_inputs(path, result.servo.scenario, result.servo.robot)
    return path


def test_live_signals_are_what_the_log_tells_afterwards(result):
    after = stability_along(result, 1.0)
    log = result.log
    np.testing.assert_array_equal(log["taut_cables"][:, 0], after.taut)
    np.testing.assert_array_equal(log["jacobian_rank"][:, 0], after.rank)
    np.testing.assert_allclose(log["stability_margin"][:, 0], after.margin, atol=SAME)
    assert np.min(after.taut) < 6  # else this says little
    assert np.min(after.rank) < 6


def test_a_summary_takes_them_from_the_log(result):
    found = summarize(result)
    log = result.log
    assert found["least_jacobian_rank"] == np.min(log["jacobian_rank"])
    assert found["least_stability_margin"] == np.min(log["stability_margin"])
    lost = np.diff(log["time"]) * (log["stability_margin"][:-1, 0] <= 0.0)
    assert found["unstable_s"] == pytest.approx(np.sum(lost))


def test_a_log_without_the_section_has_none_of_it():
    scenario = load_scenario("acrobot_slack_start", [*SHORT, "duration=0.1"])
    short = run_scenario(scenario)
    assert "stability_margin" not in short.log
    assert summarize(short)["least_jacobian_rank"] is None
    assert "stability.png" not in run_figures(short)


def test_the_block_alone(result):
    """A servo that believes the truth has the margin 1, as long as its cables hold the platform."""
    servo = build_visual_servo(load_scenario("acrobot_slack_start", SHORT))
    watch = StabilityWatch(criterion_of(servo, pulleys=False), threshold=2.0)
    context = watch.CreateDefaultContext()
    X_WP = servo.scenario.initial_pose.transform()
    for name in ("X_WP", "X_WP_estimated"):
        watch.GetInputPort(name).FixValue(context, X_WP)
    watch.GetInputPort("slack").FixValue(context, np.ones(8))

    def now(tensions):
        watch.GetInputPort("tensions").FixValue(context, np.array(tensions, float))
        names = ("taut_cables", "jacobian_rank", "stability_margin")
        return [watch.GetOutputPort(name).Eval(context)[0] for name in names]

    assert now([3.0] * 8) == pytest.approx([8.0, 6.0, 1.0])
    assert now([3.0] * 6 + [1.9, 1.9]) == pytest.approx([6.0, 6.0, 1.0])
    assert now([3.0] * 5 + [1.9] * 3) == [5.0, 5.0, 0.0]
    by_flag = StabilityWatch(criterion_of(servo, pulleys=False))
    other = by_flag.CreateDefaultContext()
    for name in ("X_WP", "X_WP_estimated"):
        by_flag.GetInputPort(name).FixValue(other, X_WP)
    by_flag.GetInputPort("tensions").FixValue(other, np.full(8, 3.0))
    by_flag.GetInputPort("slack").FixValue(other, np.ones(8))
    assert by_flag.GetOutputPort("taut_cables").Eval(other)[0] == 0.0


def test_the_block_where_no_cable_can_run():
    servo = build_visual_servo(load_scenario("acrobot_slack_start", SHORT))
    watch = StabilityWatch(criterion_of(servo, pulleys=False), threshold=0.0)
    context = watch.CreateDefaultContext()
    corner = servo.robot.cable_set().p_WA[:, 0] - servo.robot.cable_set().p_PB[:, 0]
    watch.GetInputPort("X_WP").FixValue(context, RigidTransform(corner))  # C1 has no length
    watch.GetInputPort("X_WP_estimated").FixValue(context, servo.scenario.initial_pose.transform())
    watch.GetInputPort("tensions").FixValue(context, np.ones(8))
    watch.GetInputPort("slack").FixValue(context, np.zeros(8))
    assert watch.GetOutputPort("taut_cables").Eval(context)[0] == 8.0
    assert watch.GetOutputPort("jacobian_rank").Eval(context)[0] == 0.0
    assert np.isnan(watch.GetOutputPort("stability_margin").Eval(context)[0])


def test_a_negative_threshold_is_refused():
    with pytest.raises(ScenarioError, match=r"stability\.threshold: found -1"):
        load_scenario("acrobot_slack_start", ["stability={threshold: -1}"])


def test_the_figure_is_red_where_rank_is_lost():
    time = np.linspace(0.0, 4.0, 41)
    rank = np.where((time > 1.0) & (time < 2.0), 4.0, 6.0)
    margin = np.where(rank < 6.0, 0.0, 0.9)
    figure = stability_figure("title", StabilityAlong(time, rank + 1.0, rank, margin, 6))
    cables, ranks, margins = figure.axes
    for panel in figure.axes:
        spans = [patch for patch in panel.patches if patch.get_hatch()]
        assert len(spans) == 1
        box = spans[0].get_extents().transformed(panel.transData.inverted())
        assert box.x0 == pytest.approx(1.1)
        assert 1.9 <= box.x1 <= 2.1
    thick = [line for line in ranks.lines if line.get_linewidth() >= 3.0]
    drawn = thick[0].get_ydata()
    np.testing.assert_array_equal(np.isfinite(drawn), rank < 6.0)
    assert "[-]" in cables.get_ylabel()
    assert margins.get_xlabel() == "time [s]"


def test_a_folder_gives_the_same_as_its_run(result, folder):
    found = stability_of_folder(folder, 1.0)
    np.testing.assert_allclose(found.along.margin, result.log["stability_margin"][:, 0], atol=SAME)
    assert found.as_dict()["freedom"] == 6


def test_a_figure_that_fails_costs_nothing_else(folder, tmp_path, capsys, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    with pytest.raises(SystemExit) as ended:
        main(["stability", "--along", str(folder), "--out", str(tmp_path / "o"), "--json"])
    assert ended.value.code == 3
    shown, err = printed(capsys)
    assert json.loads(shown) == json.loads((tmp_path / "o" / "stability.json").read_text())
    assert "stability.png: not written: [Errno 28]" in err
    assert (tmp_path / "o" / "stability.npz").is_file()


def test_the_command_writes_into_the_folder(folder, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["stability", "--along", str(folder), "--threshold", "1", "--json"])
    assert ended.value.code == 0
    shown = json.loads(printed(capsys).out)
    assert shown == json.loads((folder / "stability.json").read_text())
    assert shown["least_jacobian_rank"] < 6
    with np.load(folder / "stability.npz") as arrays:
        assert set(arrays) == {"time", "taut_cables", "jacobian_rank", "stability_margin"}
    assert (folder / "stability.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--along", "nowhere"], "nowhere: found no log; accepted: a folder of a visual servo"),
        (["planar", "--along", "x"], "--along: found beside robot"),
        (["--along", "x", "--seed", "2"], "--along: found beside --seed"),
        (["--along", "x", "--threshold", "-1"], "--threshold: found -1; accepted: >= 0 [N]"),
        (["planar", "--threshold", "1"], "--threshold: accepted with --along only"),
    ],
)
def test_what_the_command_refuses(arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["stability", *arguments])
    assert ended.value.code == 2
    assert words in " ".join(printed(capsys).err.split())
    assert not list(tmp_path.iterdir())


def test_a_log_that_lacks_something_is_refused(tmp_path):
    np.savez(tmp_path / "log.npz", time=np.arange(3.0))
    (tmp_path / "scenario.yaml").write_text("name: x\n")
    with pytest.raises(OutputFolderError, match="without X_WP, X_WP_estimated, tensions, slack"):
        stability_of_folder(tmp_path)
    (tmp_path / "log.npz").write_bytes(b"PK broken")
    with pytest.raises(OutputFolderError, match=r"log\.npz cannot be read"):
        stability_of_folder(tmp_path)


def test_joints_of_a_camera_count_by_the_errors_of_their_encoders():
    """As a camera at rest whose mounting is off by that turn; nothing, where they are right."""
    scenario = load_scenario("acrobot_pan_tilt", ["integration.engine=compiled"])
    servo = build_visual_servo(scenario)
    criterion, turns = run_criterion(servo), scenario.camera.pan_tilt
    at = servo.block.robot.home.transform()
    taut = np.ones(8, bool)
    right = np.radians([[20.0, -10.0], [20.0, -10.0]])
    same = turned_criterion(criterion, servo.mounting, turns, right)
    assert same.at(at, at, taut, 0.0)[1] == pytest.approx(criterion.at(at, at, taut, 0.0)[1])
    wrong = np.radians([[20.0, 0.0], [0.0, 0.0]])
    turned = turned_criterion(criterion, servo.mounting, turns, wrong)
    angle = (criterion.camera.inverse() @ turned.camera).rotation().ToAngleAxis().angle()
    assert np.degrees(angle) == pytest.approx(20.0)
    assert turned.at(at, at, taut, 0.0)[1] < 0.99 * criterion.at(at, at, taut, 0.0)[1]
    seen = turned.camera @ turned.sees(at, 0.0)
    assert seen.IsNearlyEqualTo(criterion.camera @ criterion.sees(at, 0.0), 1e-12)
