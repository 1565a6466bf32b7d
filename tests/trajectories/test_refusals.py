"""Poses, times, samples and files that make no motion are refused in one line."""

import re

import numpy as np
import pytest

from cdpr_drake.errors import CdprError, ScenarioError, TrajectoryError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.trajectories.curved_path import STRAIGHT, Move, curved_path
from cdpr_drake.trajectories.plant_motion import PlantMotion
from cdpr_drake.trajectories.pose_path import PosePath, smooth_path, straight_path
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.trajectories.sampled_motion import MOTION_COLUMNS, read_motion, sampled_motion
from cdpr_drake.trajectories.timed_path import TimedPath
from tests.trajectories.test_motions import AWAY, HOME, ROWS, TIMES, table
from tests.trajectories.test_paths import PATHS, POSES, arc, slot

NAN, INFINITY = np.nan, np.inf


def trajectory(durations, start=0.0, stops=(HOME, AWAY)):
    return PoseTrajectory(stops, durations, start)


def plant(*times):
    return PlantMotion(np.array(times), np.zeros((len(times), 1)), np.array([0]))


def samples(count=None, step=1, shift=0.0, at=(), factor=1.0):
    """Coarse ones, some left out, in time or turned, one number changed, or velocities scaled."""
    rows, times = ROWS[::100].copy(), TIMES[::100] + shift
    if at:
        rows[at] = 2.0
    rows[:, 4:7] *= factor
    return sampled_motion(times[:count][::step], rows[:count])


def curved(moves=3):
    poses, ways = slot()
    return curved_path(poses, ways[:moves], 0.2)


def own_speeds():
    path = curved(4)
    return PosePath(path.breaks, path.pieces, path.rests, np.zeros(len(path.pieces)))


def scenario(change):
    return load_scenario("acrobot_mobile_robot", [change])


MOTION = "target.motion."
REFUSALS = {
    "one pose": (lambda: trajectory((), stops=(HOME,)), "at least one duration, found 1 poses"),
    "two durations": (lambda: trajectory((1.0, 2.0)), "2 durations needs one pose more"),
    "no time": (lambda: trajectory((0.0,)), "must be above 0 s and finite, found 0.0 s"),
    "negative time": (lambda: trajectory((-1.0,)), "found -1.0 s"),
    "NaN time": (lambda: trajectory((NAN,)), "found nan s"),
    "infinite time": (lambda: trajectory((INFINITY,)), "found inf s"),
    "NaN start": (lambda: trajectory((1.0,), NAN), "start must be finite, found nan s"),
    "plant at once": (lambda: plant(0.0), "two or more that grow"),
    "plant twice": (lambda: plant(0.0, 0.0), "two or more that grow"),
    "plant back": (lambda: plant(0.0, 2.0, 1.0), "two or more that grow"),
    "one sample": (lambda: samples(1), "found 1 samples"),
    "backwards": (lambda: samples(step=-1), "after 1.3 s; accepted: times from 0 on that grow"),
    "before 0": (lambda: samples(shift=-1.0), "times from 0 on"),
    "quaternion": (lambda: samples(at=(3, 0)), "at 0.4 s: found a quaternion"),
    "no rest": (lambda: samples(8), r"at 0.8 s: found velocities up to .* rest at both ends"),
    "not one motion": (lambda: samples(factor=1e3), "of one motion, in"),
    "same pose": (lambda: smooth_path([*POSES[:2], POSES[1]], 0.1), "poses 2 and 3 are the same"),
    "one of a path": (lambda: straight_path(POSES[:1], 0.1), "found 1 poses"),
    "scale": (lambda: smooth_path(POSES, 0.0), "length scale"),
    "breaks": (lambda: PosePath(np.array([0.0, 0.0]), np.zeros((1, 42))), "breaks"),
    "still": (lambda: TimedPath.make(PATHS["line"], PATHS["line"].breaks, np.zeros(2)), "two zero"),
    "moves": (curved, "found 3 moves and 5 poses"),
    "same ends": (lambda: curved_path(POSES[:1] * 2, [STRAIGHT], 0.2), "poses 1 and 2 are the s"),
    "arc": (lambda: curved_path(slot()[0][:2], [Move(arc([1, 0, 0], [0, 0, 1], 0.0))], 0.2),
     "move 1: found an arc of 0 rad"),
    "speeds": (own_speeds, "found speeds of shape"),
    "corner": (lambda: scenario(MOTION + "mobile_robot.corner_radius=0.3"),
     "corner_radius: found 0.3; accepted: at"),
    "velocity": (lambda: scenario(MOTION + "velocity=[0.1, 0, 0]"),
     "found a velocity and a mobile_robot"),
    "lap": (lambda: scenario(MOTION + "mobile_robot.lap_time=0"), "lap_time"),
    "estimator": (lambda: scenario("estimator.kind=first_image"), "the target moves"),
    "winches": (lambda: scenario("perturbations.winch_offset_spread=-1"), "winch_offset_spread"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "words"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal(call, words):
    error = ScenarioError if "scenario" in call.__code__.co_names else TrajectoryError
    with pytest.raises(error, match=words) as caught:
        call()
    assert isinstance(caught.value, CdprError)


def test_files_that_cannot_be_read_are_named(tmp_path):
    path = tmp_path / "m.csv"
    with pytest.raises(TrajectoryError, match="no such file of a motion"):
        read_motion(tmp_path / "none.csv")
    path.write_text("")
    with pytest.raises(TrajectoryError, match="line 1: found no column time_s"):
        read_motion(path)
    table(path, (*MOTION_COLUMNS[:-1], "az"))
    with pytest.raises(TrajectoryError, match="found no column az_m_s2"):
        read_motion(path)
    table(path)
    path.write_text(path.read_text().replace("7,", "7,x", 1))
    with pytest.raises(TrajectoryError, match=re.escape(f"{path}: line 2: found '7,x")):
        read_motion(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrajectoryError, match="cannot be read as text"):
        read_motion(path)
