"""What pulls beside cables and weight: nothing in a free swing, a hand where there is one."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion_balance import PULL, PULLED, unexplained
from cdpr_drake.analyses.calibration.free_motion_model import FREE_GROUPS, FreeMotionModel
from cdpr_drake.analyses.calibration.free_motion_samples import cut, recorded_turns
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_row
from tests.analyses.calibration.test_free_motion_groups import COUNT, RATE, START, soft, swing

HAND = 20.0
"""What one cable's load cell is told too much, as if a hand held against it [N]."""

NOISE = 0.08
"""Share of a pull: noise of positions makes some 1 N of the mean over half a second."""


def stretch_of(model, log):
    return cut(model.robot, log, recorded_turns(log), [(0.0, (COUNT - 1) / RATE)])[0]


@pytest.fixture(scope="module")
def free():
    """A model, its vector, a free swing and its log."""
    model = FreeMotionModel.of(soft(), START, FREE_GROUPS, False, False)
    log = swing(model, model.before())
    return model, model.before(), stretch_of(model, log), log


def near(stretch):
    return np.tile(START.translation(), (stretch.count, 1))


def test_nothing_pulls_at_a_platform_that_swings_freely(free):
    model, vector, stretch, _ = free
    rest = unexplained(model, vector, stretch, near(stretch))
    weight = 12.992 * 9.80665
    assert rest.largest(rest.force)[0] < PULLED * weight
    assert rest.largest(rest.moment)[0] < PULLED * weight * 0.3


def test_a_hand_shows_when_it_pulls_and_how_much(free):
    model, vector, stretch, log = free
    held = slice(20, 50)
    told = stretch.tensions.copy()
    told[held, 0] += HAND
    rest = unexplained(model, vector, replace(stretch, tensions=told), near(stretch))
    force, at = rest.largest(rest.force)
    assert force == pytest.approx(HAND, rel=NOISE)
    assert stretch.time[20] - 0.1 < at < stretch.time[49] + 0.1
    # The hand holds against the cable, whose wrench is -J^T t.
    X = log.poses[35]
    by_cable = HAND * cable_paths(X, model.robot.cable_set()).J[0]
    arm = X.rotation().matrix() @ model.robot.center_of_mass()
    middle = slice(30 - 4, 40 - 4)  # without the four instants at the beginning
    np.testing.assert_allclose(np.mean(rest.force[middle], axis=0), by_cable[3:], atol=0.15 * HAND)
    moment = by_cable[:3] - np.cross(arm, by_cable[3:])
    np.testing.assert_allclose(np.mean(rest.moment[middle], axis=0), moment, atol=0.4)


def test_another_mass_shows_as_its_weight(free):
    model, vector, stretch, _ = free
    heavier = vector.copy()
    heavier[model.names.index("mass")] += 1.0
    rest = unexplained(model, heavier, stretch, near(stretch))
    assert rest.largest(rest.force)[0] == pytest.approx(9.80665, rel=0.3)  # and noise


def test_positions_may_be_those_by_cable_lengths(free):
    model, _, _, log = free
    alone = FreeMotionModel.of(model.robot, START, FREE_GROUPS, True, False)
    rows = np.array([pose_row(X) for X in log.poses])
    turns = Rotation.from_quat(rows[:, [1, 2, 3, 0]])
    tilted = replace(log, poses=None, tilts=turns.as_euler("ZYX")[:, ::-1])
    stretch = stretch_of(alone, tilted)
    rest = unexplained(alone, alone.before(), stretch, near(stretch))
    assert rest.largest(rest.force)[0] < PULLED * 12.992 * 9.80665
    assert rest.time[-1] - rest.time[0] > PULL


def test_it_is_not_told_without_all_tensions(free):
    model, vector, stretch, _ = free
    told = stretch.tensions.copy()
    told[30, 2] = np.nan
    assert unexplained(model, vector, replace(stretch, tensions=told), near(stretch)) is None
    short = stretch.first(0.1)
    assert unexplained(model, vector, short, near(short)) is None
