"""The block that follows the stability criterion live, its log signals, and a run's folder."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.folder import Folder, read_marker
from cdpr_drake.analyses.runs.along import assess_run
from cdpr_drake.analyses.runs.log import StoredLog
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.stability import (
    Stability,
    run_criterion,
    stability_along,
    stability_figure,
    turned_criterion,
)
from cdpr_drake.cli.app import main
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.sections.stability.section import StabilityWatch
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.servo_watches import criterion_of
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from tests.messages import printed

SAME = 1e-9  # two ways to the same margin differ by rounding of the logged quaternions only [-]
SLACK = "acrobot_slack_start"
SHORT = ["camera.kind=projected", "integration.engine=compiled", "duration=1.6"]
SIGNALS = ("taut_cables", "jacobian_rank", "stability_margin")


@pytest.fixture(scope="module")
def result():
    return ServoRun(load_scenario(SLACK, [*SHORT, "stability={threshold: 1}"])).simulate()


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    with Folder(path, {}) as results:
        with results.files() as stage:
            result.write_inputs(stage)
        result.write(results)
        results.complete()
    return path


@pytest.fixture(scope="module")
def servo():
    return build_visual_servo(load_scenario(SLACK, SHORT))


def test_live_signals_are_what_log_and_folder_tell_afterwards(result, folder):
    log, of_folder = result.log, assess_run(along=folder, threshold=1.0)
    assert of_folder.as_dict()["freedom"] == 6
    for along in (stability_along(result, 1.0), of_folder.along):
        np.testing.assert_array_equal(log["taut_cables"][:, 0], along.taut)
        np.testing.assert_array_equal(log["jacobian_rank"][:, 0], along.rank)
        np.testing.assert_allclose(log["stability_margin"][:, 0], along.margin, atol=SAME)
        assert np.min(along.taut) < 6  # else this says little
        assert np.min(along.rank) < 6
    steps = np.diff(log["time"])
    under = of_folder.as_dict()["underactuated_s"]
    assert under == pytest.approx(np.sum(steps * (log["jacobian_rank"][:-1, 0] < 6)))
    assert 0.0 < under < np.sum(steps)
    summary = result.as_dict()
    assert summary["least_jacobian_rank"] == np.min(log["jacobian_rank"])
    assert summary["least_stability_margin"] == np.min(log["stability_margin"])
    lost = steps * (log["stability_margin"][:-1, 0] <= 0.0)
    assert summary["unstable_s"] == pytest.approx(np.sum(lost))


def signals(servo, tensions, slack, threshold=None, X_WP=None):
    """What the block says."""
    watch = StabilityWatch(criterion_of(servo, pulleys=False), threshold=threshold)
    context, start = watch.CreateDefaultContext(), servo.scenario.initial_pose.transform()
    watch.GetInputPort("X_WP").FixValue(context, X_WP or start)
    watch.GetInputPort("X_WP_estimated").FixValue(context, start)
    watch.GetInputPort("tensions").FixValue(context, np.array(tensions, float))
    watch.GetInputPort("slack").FixValue(context, np.full(8, float(slack)))
    return [watch.GetOutputPort(name).Eval(context)[0] for name in SIGNALS]


def test_the_block_alone(servo):
    """A servo that believes the truth has the margin 1, as long as its cables hold the platform.
    Which are taut a threshold tells or, without one, flags. Where C1 has no length none can run."""
    assert signals(servo, [3.0] * 8, 1, 2.0) == pytest.approx([8.0, 6.0, 1.0])
    assert signals(servo, [3.0] * 6 + [1.9] * 2, 1, 2.0) == pytest.approx([6.0, 6.0, 1.0])
    assert signals(servo, [3.0] * 5 + [1.9] * 3, 1, 2.0) == [5.0, 5.0, 0.0]
    assert signals(servo, [3.0] * 8, 1)[0] == 0.0
    corner = servo.robot.cable_set().p_WA[:, 0] - servo.robot.cable_set().p_PB[:, 0]
    at_corner = signals(servo, np.ones(8), 0, 0.0, RigidTransform(corner))
    np.testing.assert_array_equal(at_corner, [8.0, 0.0, np.nan])


def test_the_figure_is_red_where_rank_is_lost():
    time = np.linspace(0.0, 4.0, 41)
    rank = np.where((time > 1.0) & (time < 2.0), 4.0, 6.0)
    margin = np.where(rank < 6.0, 0.0, 0.9)
    along = Stability(time, rank + 1.0, rank, margin, 6)
    figure = stability_figure("title", along)
    cables, ranks, margins = figure.axes
    for panel in figure.axes:
        (span,) = (patch for patch in panel.patches if patch.get_hatch())
        box = span.get_extents().transformed(panel.transData.inverted())
        assert box.x0 == pytest.approx(1.1)
        assert 1.9 <= box.x1 <= 2.1
    thick = next(line for line in ranks.lines if line.get_linewidth() >= 3.0)
    np.testing.assert_array_equal(np.isfinite(thick.get_ydata()), rank < 6.0)
    assert "[-]" in cables.get_ylabel()
    assert margins.get_xlabel() == "time [s]"
    assert margins.get_title() == ""
    deep = replace(along, margin=np.where(rank < 6.0, -9.0, 0.9))
    assert stability_figure("title", deep).axes[2].get_title() == "least -9.00, cut off at -1.5"
    assert along.numbers()["unstable_s"] == pytest.approx(0.9)


def command(capsys, *arguments):
    """Exit code, standard output and standard error."""
    with pytest.raises(SystemExit) as ended:
        main(["stability", *map(str, arguments)])
    return ended.value.code, *printed(capsys)


def test_the_command_writes_into_the_folder(folder, capsys):
    code, out, _ = command(capsys, "--along", folder, "--threshold", "1", "--json")
    assert code == 0
    assert json.loads(out) == json.loads((folder / "stability.json").read_text())
    assert json.loads(out)["least_jacobian_rank"] < 6
    with np.load(folder / "stability.npz") as arrays:
        assert set(arrays) == {"time", *SIGNALS}
    assert (folder / "stability.png").is_file()
    assert read_marker(folder)["complete"]


def test_a_figure_that_fails_costs_nothing_else(folder, tmp_path, capsys, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    code, out, err = command(capsys, "--along", folder, "--out", tmp_path / "o", "--json")
    assert code == 3
    assert json.loads(out) == json.loads((tmp_path / "o" / "stability.json").read_text())
    assert re.search("stability.png: not written: .*No space left on device", err)
    assert (tmp_path / "o" / "stability.npz").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--along", "nowhere"], "nowhere: found no log; accepted: a folder of a visual servo"),
        (["planar", "--along", "x"], "found 'planar' with --along; accepted: fewer words"),
        (["--along", "x", "--seed", "2"], "--seed: found with --along; accepted: without --along"),
        (["--along", "x", "--threshold", "-1"], "--threshold: found -1; accepted: >= 0 [N]"),
        (["planar", "--threshold", "1"], "--threshold: found without --along; accepted: with"),
    ],
)
def test_what_the_command_refuses(arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = command(capsys, *arguments)
    assert code == 2
    assert words in " ".join(err.split())
    assert not list(tmp_path.iterdir())


def test_a_log_that_lacks_something_is_refused(tmp_path):
    np.savez(tmp_path / "log.npz", time=np.arange(3.0))
    (tmp_path / "scenario.yaml").write_text("name: x\n")
    with pytest.raises(OutputFolderError, match="without X_WP, X_WP_estimated, tensions, slack"):
        assess_run(along=tmp_path)
    (tmp_path / "log.npz").write_bytes(b"PK broken")
    with pytest.raises(OutputFolderError, match=r"log\.npz cannot be read"):
        assess_run(along=tmp_path)


def test_a_quantity_of_a_log_that_is_damaged_is_named_by_its_file(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, time=np.arange(300.0))
    log, content = StoredLog(path), bytearray(path.read_bytes())
    content[1000] ^= 255  # an array's numbers, of which the file has a sum
    path.write_bytes(content)
    with pytest.raises(OutputFolderError, match=r"log\.npz cannot be read: Bad CRC"):
        log["time"]


def test_joints_of_a_camera_count_by_the_errors_of_their_encoders():
    """As a camera at rest whose mounting is off by that turn; nothing, where they are right."""
    scenario = load_scenario("acrobot_pan_tilt", ["integration.engine=compiled"])
    run = ServoRun(scenario)
    criterion, servo = run_criterion(run), run.built
    at = servo.block.robot.home.transform()

    def turned(degrees):
        joints, encoders = np.radians(degrees)
        log, rest = (
            {"camera_joints": joints[None], "camera_encoders": encoders[None]},
            servo.mounting,
        )
        (true,), (believed,) = (
            scenario.camera.pan_tilt.mountings(rest, log, [0], known) for known in (False, True)
        )
        return turned_criterion(criterion, rest.X_BC, true.X_BC, believed.X_BC)

    def margin(criterion):
        return criterion.at(at, at, np.ones(8, bool), 0.0)[1]

    right = turned([[20.0, -10.0], [20.0, -10.0]])
    assert margin(right) == pytest.approx(margin(criterion))
    wrong = turned([[20.0, 0.0], [0.0, 0.0]])
    off = criterion.camera.inverse() @ wrong.camera
    assert np.degrees(off.rotation().ToAngleAxis().angle()) == pytest.approx(20.0)
    true = scenario.camera.pan_tilt.turned(servo.mounting, np.radians([20.0, 0.0]))
    assert true.X_BC.IsNearlyEqualTo(servo.mounting.X_BC @ off, 1e-12)
    assert margin(wrong) < 0.99 * margin(criterion)
    seen = wrong.camera @ wrong.sees(at, 0.0)
    assert seen.IsNearlyEqualTo(criterion.camera @ criterion.sees(at, 0.0), 1e-12)
