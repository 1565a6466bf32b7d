"""Plans as cable lengths and motor angles over time."""

import json

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.planning.cable_streams import CHECK, LENGTHS, cable_stream
from cdpr_drake.cables.models import CATENARY, ELASTIC, cable_state
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.planning.path_task import sample_motion

SOLVED = 1e-6
"""Share of a tension to which lengths are solved; rounding of lengths times stiffness is less."""


@pytest.fixture(scope="module")
def run():
    robot = cdpr.load_robot("acrobot_fully_constrained")
    poses = [[0.0, 0.0, 0.4], [0.1, 0.1, 0.5], [-0.1, 0.1, 0.5]]
    places = [cdpr.Pose(position=np.array(p), angles_deg=np.zeros(3)).transform() for p in poses]
    return cdpr.plan_path(robot, places, limits=(5.0, 55.0))


@pytest.mark.parametrize("model", [ELASTIC, CATENARY])
def test_lengths_give_the_tensions_of_the_plan(run, model):
    stream = cable_stream(run, 100.0, model)
    wanted = sample_motion(run.task, run.motion, stream.times).tensions
    for time, l0, tensions in zip(stream.times, stream.lengths, wanted, strict=True):
        X = pose_from_row(run.motion.motion(float(time))[:7])
        found = cable_state(run.task.cables, model, X, l0).tensions
        np.testing.assert_allclose(found, tensions, rtol=SOLVED, atol=1e-6)


def test_motor_angles_are_lengths_over_drums(run):
    stream = cable_stream(run, 50.0)
    winch = run.robot.winch
    radius = winch.drum_radius + run.robot.cable.diameter / 2.0
    paid_out = stream.motor_angles * radius / winch.gear_ratio
    np.testing.assert_allclose(paid_out, stream.lengths - stream.zero_lengths, rtol=0.05, atol=1e-9)
    assert np.all(np.sign(stream.motor_angles) == np.sign(stream.lengths - stream.zero_lengths))


def test_a_stream_that_is_too_coarse_lets_cables_go_slack(run):
    fine, coarse = cable_stream(run, 1000.0), cable_stream(run, 5.0)
    assert fine.check.keeps_taut
    assert not coarse.check.keeps_taut
    assert np.min(coarse.check.least) < np.min(fine.check.least)
    assert "CABLES GO SLACK" in repr(coarse)


@pytest.mark.parametrize("model", [ELASTIC, CATENARY])
def test_its_figure_has_what_drives_are_sent(run, model):
    stream = cable_stream(run, 50.0, model)
    figure = stream.plot()
    lengths, angles, stretch = figure.axes
    m = len(run.robot.cables)
    for place, values in (
        (lengths, stream.lengths), (angles, stream.motor_angles / (2.0 * np.pi)),
        (stretch, 1e3 * stream.stretch),
    ):  # fmt: skip
        drawn = [line.get_ydata() for line in place.lines if len(line.get_xdata()) > 2][:m]
        assert max(map(np.max, drawn)) == pytest.approx(np.max(values))
        assert min(map(np.min, drawn)) == pytest.approx(np.min(values))
        assert "[" in place.get_ylabel()
    assert ("sag" in stretch.get_ylabel()) == (model == CATENARY)
    assert len(lengths.get_legend().get_texts()) == m


def test_files_of_a_stream(run, tmp_path):
    stream = cable_stream(run, 50.0)
    with Folder(tmp_path / "out", {}) as folder:
        stream.write(folder)
    assert json.loads((tmp_path / "out" / CHECK).read_text()) == stream.as_dict()
    rows = np.genfromtxt(tmp_path / "out" / LENGTHS, delimiter=",", names=True)
    assert rows["time_s"][-1] == pytest.approx(run.motion.end_time)


@pytest.mark.parametrize(("rate", "model", "words"), [
    (0.1, ELASTIC, "rate: found 0.1 Hz"), (50.0, "kelvin_voigt", "model: found 'kelvin_voigt'"),
])  # fmt: skip
def test_what_makes_no_stream_is_refused(run, rate, model, words):
    with pytest.raises(PlanningError, match=words):
        cable_stream(run, rate, model)
