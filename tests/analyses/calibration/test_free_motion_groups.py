"""What a free motion tells beside the elastic law: hysteresis, stiffening, creep, found again."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion import (
    FreeMotionTask,
    FreeSigmas,
    fit_free_motion,
)
from cdpr_drake.analyses.calibration.free_motion_model import FREE_GROUPS, FreeMotionModel
from cdpr_drake.analyses.calibration.free_motion_report import freely_moved_robot
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.equilibrium import equilibrium_near

SIGMAS = 4.0
"""Standard errors by which a value may be off, as in the other tests of free motion."""

START, COUNT, RATE = RigidTransform([0.01, -0.02, 0.45]), 60, 50.0
NOISE = FreeSigmas(turn=0.002, position=0.001, tension=0.5)

TRUE = {
    "hysteresis": {"hysteresis.tilt": 4.0, "hysteresis.turn": 6.0, "hysteresis.slip": 0.08},
    "stiffening": {"all.stiffening": 6e-3},
    "creep": {"all.creep_stiffness": 0.3, "all.creep_time": 0.3},
}


def soft():
    """IRMA4U on cables as soft as its log says, for steps of two milliseconds."""
    robot = load_robot("irma4u")
    cable = replace(robot.cable, youngs_modulus=3e10, retardation_time=0.004)
    return replace(robot, cable=cable)


def swing(model, vector, seed=0):
    """A noisy log of a swing from where elastic cables of these lengths hold the platform."""
    random = np.random.default_rng(seed)
    l0, cables = model.lengths(vector), model.robot.cable_set()
    rest = equilibrium_near(cables, ELASTIC, model.platform(vector), l0, START).X_WP
    turn = Rotation.from_matrix((rest.rotation() @ START.rotation().inverse()).matrix())
    w = np.array([1.5, -1.0, 2.5])
    J = cable_paths(rest, cables).J
    v = np.linalg.lstsq(J[:, 3:], -J[:, :3] @ w, rcond=None)[0]  # along no cable
    moved = np.concatenate([turn.as_rotvec(), rest.translation() - START.translation(), w, v])
    states, tensions = model.run(vector, moved, COUNT, 1.0 / RATE)
    turns = Rotation.from_quat(states[:, [1, 2, 3, 0]])
    turns = turns * Rotation.from_rotvec(NOISE.turn * random.standard_normal((COUNT, 3)))
    places = states[:, 4:7] + NOISE.position * random.standard_normal((COUNT, 3))
    tensions = tensions + NOISE.tension * random.standard_normal(tensions.shape)
    poses = [
        RigidTransform(RotationMatrix(R), p) for R, p in zip(turns.as_matrix(), places, strict=True)
    ]
    return CalibrationLog(
        "swing", COUNT, time=np.arange(COUNT) / RATE, poses=poses, tensions=tensions
    )


@pytest.mark.parametrize("group", TRUE)
def test_what_a_swing_was_made_with_is_found(group):
    robot = soft()
    model = FreeMotionModel.of(robot, START, (group,), False, False)
    vector = model.before()
    for name, value in TRUE[group].items():
        vector[model.names.index(name)] = value
    found = fit_free_motion(
        FreeMotionTask(
            robot=robot, unknown=(group,), stretches=((0.0, (COUNT - 1) / RATE),), sigmas=NOISE,
            start=START,
        ),
        swing(model, vector),
    )  # fmt: skip
    assert 0.85 < found.spread < 1.15
    by_name = dict(zip(model.names, zip(found.values, found.std, strict=True), strict=True))
    for name, value in TRUE[group].items():
        at, std = by_name[name]
        assert abs(at - value) < SIGMAS * std, (name, at, std)
        assert std < 0.5 * value  # it is told
    said = " ".join(found.remarks)
    assert ("rests beside its pose" in said) == (group == "hysteresis")
    moved = freely_moved_robot(found)
    rubs = moved.platform.hysteresis
    assert (rubs is not None) == (group == "hysteresis")
    if rubs is not None:  # the file holds what was found, and a fit begins there
        for name in ("tilt", "turn", "slip"):
            assert getattr(rubs, name) == by_name[f"hysteresis.{name}"][0]
        again = FreeMotionModel.of(moved, START, ("hysteresis",), False, False)
        assert again.by_name(again.before())["hysteresis.tilt"] == rubs.tilt
    does = moved.cable_behaviour()
    assert does.stiffening == pytest.approx(by_name.get("all.stiffening", (0.0, 0.0))[0])
    assert does.creep_stiffness == pytest.approx(by_name.get("all.creep_stiffness", (0.0, 0.0))[0])


def test_nothing_of_it_is_unknown_unless_it_is_named():
    model = FreeMotionModel.of(soft(), START, FREE_GROUPS, False, False)
    assert not {name for name in model.names if "hysteresis" in name or "creep" in name}
    assert "all.stiffening" not in model.names
    assert model.first() == pytest.approx(np.zeros(len(model.names)))
