"""What a free motion tells beside the elastic law: contacts and load cells; see `many_swings`."""

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
from cdpr_drake.analyses.calibration.free_motion_model import (
    FREE_GROUPS,
    FreeMotionModel,
    usually_bent,
)
from cdpr_drake.analyses.calibration.free_motion_report import freely_moved_robot
from cdpr_drake.analyses.calibration.free_motion_sensor import (
    sensed_tensions,
    unsensed_tensions,
)
from cdpr_drake.analyses.calibration.log_file import CalibrationLog
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.equilibrium import equilibrium_near

SIGMAS = 4.0
"""Standard errors by which a value may be off, as in the other tests of free motion."""

START, COUNT, RATE = RigidTransform([0.01, -0.02, 0.45]), 60, 50.0
NOISE = FreeSigmas(turn=0.002, position=0.001, tension=0.5)

RUBBING = {"hysteresis.tilt": 4.0, "hysteresis.turn": 6.0, "hysteresis.slip": 0.08}

FIRST_STEP = 0.02
"""Share by which a rate over two milliseconds is another than at their beginning: contacts move by
a hundredth of what they are bent by."""

BENT = np.array([-0.8, 0.7, -0.9])
"""Where contacts are when the log begins, as shares of the slip: against the velocity."""


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
    moved = np.concatenate([moved, BENT[: model.memory]])
    states, tensions = model.run(vector, moved, COUNT, 1.0 / RATE)
    tensions = sensed_tensions(model, vector, tensions)
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


def test_scale_and_zeros_of_load_cells_are_found():
    groups = ("load_cells", "load_cell_zeros")
    model = FreeMotionModel.of(soft(), START, groups, False, False)
    true = {"load_cells.scale": 0.94, "C1.load_cell_zero": 3.0, "C3.load_cell_zero": -4.0}
    vector = model.before()
    for name, value in true.items():
        vector[model.names.index(name)] = value
    task = FreeMotionTask(
        robot=soft(), unknown=groups, stretches=((0.0, (COUNT - 1) / RATE),), sigmas=NOISE,
        start=START,
    )  # fmt: skip
    found = fit_free_motion(task, swing(model, vector))
    assert 0.85 < found.spread < 1.15
    by_name = dict(zip(model.names, zip(found.values, found.std, strict=True), strict=True))
    for name, value in true.items():
        at, std = by_name[name]
        assert abs(at - value) < SIGMAS * std, (name, at, std)
        assert std < 0.5 * abs(value)  # it is told
    assert "rests beside its pose" not in " ".join(found.remarks)
    assert freely_moved_robot(found).platform.hysteresis is None


def test_nothing_of_it_is_unknown_unless_it_is_named():
    model = FreeMotionModel.of(soft(), START, FREE_GROUPS, False, False)
    assert not {name for name in model.names if "hysteresis" in name or "creep" in name}
    assert "all.stiffening" not in model.names
    assert model.first() == pytest.approx(np.zeros(len(model.names)))


def test_contacts_begin_where_they_are_said_to_be():
    model = FreeMotionModel.of(soft(), START, ("hysteresis",), False, False)
    vector = model.before()
    for name, value in RUBBING.items():
        vector[model.names.index(name)] = value
    assert model.memory == 3
    moved = np.zeros(12)
    moved[6:9] = [0.6, -0.3, 0.9]
    state = np.array([1.0] + 6 * [0.0])
    usual = model.run(vector, moved, 20, 0.02)[0]
    again = model.run(vector, np.concatenate([moved, usually_bent(state, moved[6:9])]), 20, 0.02)[0]
    np.testing.assert_array_equal(usual, again)
    # M = -K z is the only difference at the first instant: what turns otherwise is its work.
    h = 2e-3
    n = model.by_name(vector)
    K = np.array([n["hysteresis.tilt"], n["hysteresis.tilt"], n["hysteresis.turn"]])
    with_it, without = (
        model.run(vector, np.concatenate([moved, b]), 2, h)[0][1, 7:10] for b in (BENT, 0.0 * BENT)
    )
    platform = model.platform(vector)
    c, mass = platform.p_PCo, platform.mass
    M = np.zeros((6, 6))  # about Po, turned as W is
    S = cross_matrix(c)
    M[:3, :3], M[:3, 3:], M[3:, :3], M[3:, 3:] = (
        platform.I_PPo,
        mass * S,
        -mass * S,
        mass * np.eye(3),
    )
    rate = np.linalg.solve(M, np.concatenate([-K * n["hysteresis.slip"] * BENT, np.zeros(3)]))[:3]
    assert (with_it - without) / h == pytest.approx(rate, rel=FIRST_STEP)


def test_what_load_cells_tell_goes_back_to_tensions():
    model = FreeMotionModel.of(soft(), START, ("load_cells", "load_cell_zeros"), False, False)
    vector = model.before() + 0.3 * np.arange(len(model.names))
    pulls = np.array([[40.0, 50.0, 60.0, 0.0]])
    told = sensed_tensions(model, vector, pulls)
    np.testing.assert_allclose(unsensed_tensions(model, vector, told), pulls, atol=1e-12)
    n = model.by_name(vector)
    assert told[0, 3] == pytest.approx(n["C4.load_cell_zero"])


def test_what_is_known_beforehand_weighs_and_counts():
    model = FreeMotionModel.of(soft(), START, FREE_GROUPS, False, False)
    known = model.knowing({"mass": 0.1})
    (mass,) = [one for one in known.unknowns if one.group == "mass"]
    assert (mass.size, mass.known) == (0.1, True)
    assert [one.known for one in known.unknowns].count(True) == 1
    for given, words in (
        ({"masses": 1.0}, "priors: found 'masses'; accepted: of what is unknown, mass, center"),
        ({"mass": -1.0}, r"priors: mass: found -1; accepted: > 0 \[kg\]"),
    ):
        with pytest.raises(IdentificationError, match=words):
            model.knowing(given)
    with pytest.raises(IdentificationError, match="found 'mass'; accepted: of what is unknown, st"):
        FreeMotionModel.of(soft(), START, ("stiffness",), False, False).knowing({"mass": 0.1})


def test_a_swing_tells_masses_and_forces_only_beside_what_load_cells_tell():
    groups = (*FREE_GROUPS, "hysteresis", "load_cells")
    model = FreeMotionModel.of(soft(), START, groups, False, False)
    vector = model.before()
    for name, value in {**RUBBING, "drag.force": 1.2, "drag.moment": 0.1}.items():
        vector[model.names.index(name)] = value
    heavier, share = vector.copy(), 1.1
    grows = ("mass", "inertia.", "all.stiffness", "drag.", "hysteresis.t")
    for k, name in enumerate(model.names):
        heavier[k] *= share if name.startswith(grows) else 1.0
    heavier[model.names.index("load_cells.scale")] /= share
    moved = np.concatenate([np.zeros(3), [0.0, 0.0, -0.002], [0.6, -0.3, 0.9], np.zeros(3), BENT])
    (states, pulls), (again, other) = (model.run(v, moved, 30, 0.02) for v in (vector, heavier))
    np.testing.assert_allclose(again, states, atol=1e-9)
    assert np.max(other) > 1.05 * np.max(pulls)
    told = [sensed_tensions(model, v, t) for v, t in ((vector, pulls), (heavier, other))]
    np.testing.assert_allclose(told[1], told[0], atol=1e-6)
