"""What a free motion tells beside the elastic law: behaviours of cables, contacts, load cells."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion_balance import PULL, PULLED, unexplained
from cdpr_drake.analyses.calibration.free_motion_model import (
    FREE_GROUPS,
    FreeMotionModel,
    usually_bent,
)
from cdpr_drake.analyses.calibration.free_motion_samples import cut, recorded_turns
from cdpr_drake.analyses.calibration.free_motion_sensor import sensed_tensions, unsensed_tensions
from cdpr_drake.analyses.fits.swings import swung_robot
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import IdentificationError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import cross_matrix, pose_row
from cdpr_drake.statics.equilibrium import equilibrium_near
from tests.analyses.fits.many_swings import (
    COUNT,
    RATE,
    START,
    TRUE,
    fitted,
    identified,
    noisy,
    off_by,
    push,
    soft,
)

SIGMAS = 4.0
"""Standard errors by which a value may be off; `many_swings` counts those beyond 3."""

RUBBING = TRUE["hysteresis"]

FIRST_STEP = 0.02
"""Share by which a rate over two milliseconds is another than at their beginning: contacts move by
a hundredth of what they are bent by."""

BENT = np.array([-0.8, 0.7, -0.9])
"""Where contacts are when the log begins, as shares of the slip: against the velocity."""


def swing(model, vector, seed=0):
    """A noisy log of a swing from where elastic cables of these lengths hold the platform."""
    l0, cables = model.lengths(vector), model.robot.cable_set()
    rest = equilibrium_near(cables, ELASTIC, model.platform(vector), l0, START).X_WP
    turn = Rotation.from_matrix((rest.rotation() @ START.rotation().inverse()).matrix())
    moved = [turn.as_rotvec(), rest.translation() - START.translation(), push(rest, cables)]
    moved = np.concatenate([*moved, BENT[: model.memory]])
    states, tensions = model.run(vector, moved, COUNT, 1.0 / RATE)
    return noisy(states, sensed_tensions(model, vector, tensions), np.random.default_rng(seed))


def model_of(*groups, robot=None):
    return FreeMotionModel.of(robot or soft(""), START, groups, False, False)


def changed(model, values):
    """The vector as it is believed, but for these."""
    vector = model.before()
    for name, value in values.items():
        vector[model.names.index(name)] = value
    return vector


@pytest.mark.parametrize("group", ["hysteresis", "stiffening", "creep"])
def test_what_the_plant_swung_with_is_found(group):
    found = identified(group, 0)
    assert 0.85 < found.spread < 1.15
    assert np.max(np.abs(off_by(group, found))) < SIGMAS
    by_name, std = (
        {one.name: x for one, x in zip(found.unknowns, values, strict=True)}
        for values in (found.values, found.std)
    )
    for name, value in TRUE[group].items():
        assert std[name] < 0.5 * abs(value), f"{name} is not told"
    assert ("rests beside its pose" in " ".join(found.remarks)) == (group == "hysteresis")
    moved = swung_robot(found)
    rubs = moved.platform.hysteresis
    assert (rubs is not None) == (group == "hysteresis")
    if rubs is not None:  # the file holds what was found, and a fit begins there
        for name in ("tilt", "turn", "slip"):
            assert getattr(rubs, name) == by_name[f"hysteresis.{name}"]
        again = model_of("hysteresis", robot=moved)
        assert again.by_name(again.before())["hysteresis.tilt"] == rubs.tilt
    does = moved.cable_behaviour()
    assert does.stiffening == pytest.approx(by_name.get("all.stiffening", 0.0))
    assert does.creep_stiffness == pytest.approx(by_name.get("all.creep_stiffness", 0.0))


def test_scale_and_zeros_of_load_cells_are_found():
    groups = ("load_cells", "load_cell_zeros")
    true = {"load_cells.scale": 0.94, "C1.load_cell_zero": 3.0, "C3.load_cell_zero": -4.0}
    model = model_of(*groups)
    found = fitted(soft(""), groups, swing(model, changed(model, true)))
    assert 0.85 < found.spread < 1.15
    by_name = dict(zip(model.names, zip(found.values, found.std, strict=True), strict=True))
    for name, value in true.items():
        at, std = by_name[name]
        assert abs(at - value) < SIGMAS * std, (name, at, std)
        assert std < 0.5 * abs(value)  # it is told
    assert "rests beside its pose" not in " ".join(found.remarks)
    assert swung_robot(found).platform.hysteresis is None


def test_nothing_of_it_is_unknown_unless_it_is_named():
    model = model_of(*FREE_GROUPS)
    assert not {name for name in model.names if "hysteresis" in name or "creep" in name}
    assert "all.stiffening" not in model.names
    assert model.first() == pytest.approx(np.zeros(len(model.names)))


def test_contacts_begin_where_they_are_said_to_be():
    model = model_of("hysteresis")
    vector = changed(model, RUBBING)
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
    mass, S = platform.mass, platform.mass * cross_matrix(platform.p_PCo)
    M = np.block([[platform.I_PPo, S], [-S, mass * np.eye(3)]])  # about Po, turned as W is
    rate = np.linalg.solve(M, np.concatenate([-K * n["hysteresis.slip"] * BENT, np.zeros(3)]))[:3]
    assert (with_it - without) / h == pytest.approx(rate, rel=FIRST_STEP)


def test_what_load_cells_tell_goes_back_to_tensions():
    model = model_of("load_cells", "load_cell_zeros")
    vector = model.before() + 0.3 * np.arange(len(model.names))
    pulls = np.array([[40.0, 50.0, 60.0, 0.0]])
    told = sensed_tensions(model, vector, pulls)
    np.testing.assert_allclose(unsensed_tensions(model, vector, told), pulls, atol=1e-12)
    n = model.by_name(vector)
    assert told[0, 3] == pytest.approx(n["C4.load_cell_zero"])


def test_what_is_known_beforehand_weighs_and_counts():
    model = model_of(*FREE_GROUPS)
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
        model_of("stiffness").knowing({"mass": 0.1})


def test_a_swing_tells_masses_and_forces_only_beside_what_load_cells_tell():
    groups = (*FREE_GROUPS, "hysteresis", "load_cells")
    model = model_of(*groups)
    vector = changed(model, {**RUBBING, "drag.force": 1.2, "drag.moment": 0.1})
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


# What pulls beside cables and weight: nothing in a free swing, a hand where there is one.

HAND = 20.0
"""What one cable's load cell is told too much, as if a hand held against it [N]."""

NOISE = 0.08
"""Share of a pull: noise of positions makes some 1 N of the mean over half a second."""


def stretch_of(model, log):
    return cut(model.robot, log, recorded_turns(log), [(0.0, (COUNT - 1) / RATE)])[0]


@pytest.fixture(scope="module")
def free():
    """A model, its vector, a free swing and its log."""
    model = model_of(*FREE_GROUPS)
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
