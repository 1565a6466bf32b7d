"""Identification from free motion: swings by Drake's plant, behaviours of cables, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.fits.swings import (
    dominant_frequency,
    identify_swings,
    swing_log,
    swinging_robot,
    swung_robot,
)
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import IdentificationError, StoppedError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import cross_matrix, pose_row
from cdpr_drake.identification.swing_log import cut
from cdpr_drake.identification.swing_model import FREE_GROUPS, SwingModel, earlier, usually_bent
from cdpr_drake.identification.swing_prediction import PULL, PULLED, unexplained
from cdpr_drake.identification.swing_states import StartCoordinates
from cdpr_drake.identification.swings import SMALL, steps_within
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.statics.equilibrium import equilibrium_near
from tests.analyses.fits import swings
from tests.analyses.fits.swings import COUNT, RATE, START, soft
from tests.cli.commands import ended, refuse

SIGMAS = 4.0
"""Standard errors by which a value may be off: one of 23 by 3 happens now and then."""

PREDICTED_TURN, PREDICTED_PLACE = 0.01, 2e-3
"""Of a held-out stretch [rad, m]: five times the noise of turns, which its first state has."""

HERMITE_TOLERANCE = 5e-6
"""h^4 / 384 of a fourth derivative of 9^4, twice."""

FREQUENCY_TOLERANCE = 0.015
"""Share of a dominant frequency: 1.6 s tell 0.6 Hz apart, noise moves the peak by some 0.02 Hz."""


def spans_words(spans):
    """Stretches as options take them."""
    return ",".join(f"{a:.6g}:{b:.6g}" for a, b in spans)


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """The command on two fitted swings and one that is held out: JSON and folder.

    Of what is fitted the first 0.8 s are enough.
    """
    folder = tmp_path_factory.mktemp("swings")
    spans = swings.write(folder / "log.csv", (0, 1, 2))
    fitted = spans_words((first, first + 0.8) for first, _ in spans[:2])
    sigmas = ",".join(f"{name}={value}" for name, value in swings.LOG_NOISE.items())
    code = ended(
        "identify-swings", swings.believed_file(folder), folder / "log.csv", "--stretches", fitted,
        "--hold-out", spans_words(spans[2:]), "--out", folder / "out", "--lead", "0.8",
        "--sigma", sigmas, "--json",
    )  # fmt: skip
    assert code == 0
    return json.loads((folder / "out/results.json").read_text()), folder / "out"


def test_a_swing_by_the_plant_tells_the_platform_and_its_cables(identified):
    said, out = identified
    assert said["status"] == "optimal"
    # Sigmas are those of the noise; what the model is asked late for is interpolated.
    assert 0.9 < said["residuals_over_sigma"] < 1.1
    assert not any("before it settled" in words for words in said["remarks"])
    true = {
        "mass": swings.CHANGED["mass"], "all.stiffness": 4e10 * np.pi * 1e-6,
        "all.retardation_time": 0.004, "drag.force": swings.DRAG[0], "drag.moment": swings.DRAG[1],
        "sensor.late": swings.LATE, "sensor.heading": swings.HEADING,
    }  # fmt: skip
    for what, axes in (("center_of_mass", "x y z"), ("inertia", "xx yy zz xy xz yz")):
        names = [f"{what}.{axis}" for axis in axes.split()]
        true |= dict(zip(names, swings.CHANGED[what], strict=True))
    by_name = {one["name"]: one for one in said["parameters"]}
    for name, value in true.items():
        one = by_name[name]
        assert abs(one["value"] - value) < SIGMAS * one["std"], (name, one, value)
    for name in ("mass", "all.stiffness", "inertia.zz"):
        assert by_name[name]["value"] == pytest.approx(true[name], rel=0.05)
    robot = load_robot(str(out / "robot.yaml"))
    assert robot.platform.mass == pytest.approx(by_name["mass"]["value"])
    stiffness = by_name["all.stiffness"]["value"]
    np.testing.assert_allclose(robot.cable_set().stiffness, stiffness, rtol=1e-9)
    assert {path.stem for path in out.glob("*.png")} >= {"held_out", "unexplained"}
    for one in said["fitted"] + said["held_out"]:
        assert one["unexplained"]["force_n"] < PULLED * true["mass"] * 9.80665
    assert not any("neither cables nor weight" in words for words in said["remarks"])


def test_a_held_out_swing_is_predicted(identified):
    said, _ = identified
    (one,) = said["held_out"]
    assert one["turn_rms_rad"] < PREDICTED_TURN
    assert one["position_rms_m"] < PREDICTED_PLACE
    assert one["frequencies"]
    assert all(abs(each["off"]) < FREQUENCY_TOLERANCE for each in one["frequencies"])
    # The model as it was believed has other modes; what was found has the true ones.
    assert abs(said["modes_before_hz"][0] / said["modes_hz"][0] - 1.0) > 0.02


def model_of(*groups, robot=None, lengths=False):
    return SwingModel.of(swinging_robot(robot or soft()), START, groups, lengths, False)


def changed(model, values):
    """The vector as it is believed, but for these."""
    vector = model.before()
    for name, value in values.items():
        vector[model.names.index(name)] = value
    return vector


def first_tensions(model, vector, moved):
    return model.run(vector, moved, 2, 0.01)[1][0]


NEAR = np.array([0.2, -0.1, 0.3, 0.02, 0.01, -0.03])
"""A turn and a shift of the first pose [rad, m]."""


def test_what_cables_pull_at_first_stays_while_their_lengths_are_sought():
    model = model_of(*FREE_GROUPS, robot=swings.BELIEVED, lengths=True)
    near = np.concatenate([NEAR, [1.0, -2.0, 0.5, 0.1, 0.2, 0.0]])
    at = StartCoordinates.about(model, near)
    assert at.pulls.shape == (4, 4)
    assert at.free.shape == (6, 2)
    vector = model.before()
    y = at.of(vector, near)
    np.testing.assert_allclose(at.moved(vector, y), near, atol=1e-12)
    longer = vector.copy()
    longer[: len(swings.BELIEVED.cables)] *= 1.03
    longer[model.names.index("all.stiffness")] *= 1.2
    moved = at.moved(longer, y)
    assert np.linalg.norm(moved[3:6] - near[3:6]) > 0.02
    np.testing.assert_allclose(at.of(longer, moved), y, rtol=0.0, atol=1e-9)
    pulled, again = (
        first_tensions(model, at_vector, np.concatenate([pose[:6], np.zeros(6)]))
        for at_vector, pose in ((vector, near), (longer, moved))
    )
    assert np.min(pulled) > 0.0
    # Stiffness times stretch stays; a cable 3 % longer pulls as much less for it.
    np.testing.assert_allclose(again * 1.03, pulled, rtol=1e-9)


def test_what_stiffening_cables_pull_at_first_stays_while_it_is_sought():
    model = model_of(*FREE_GROUPS, "stiffening", robot=swings.BELIEVED, lengths=True)
    near = np.concatenate([NEAR, np.zeros(6)])
    vector, stiffer = (changed(model, {"all.stiffening": value}) for value in (2e-3, 8e-3))
    at = StartCoordinates.about(model, near)
    # A pose in which every cable pulls: from coordinates, as a search would come to it.
    y = at.of(model.before(), near)
    y[: at.pulls.shape[1]] = at.pulls.T @ np.array([1.0, 1.3, 0.8, 1.1])
    moved = at.moved(vector, y)
    np.testing.assert_allclose(at.of(vector, moved), y, rtol=0.0, atol=1e-9)
    pulled = first_tensions(model, vector, moved)
    assert np.min(pulled) > 0.0
    again = first_tensions(model, stiffer, at.moved(stiffer, y))
    np.testing.assert_allclose(again, pulled, rtol=1e-9)


def test_states_a_time_earlier_are_those_of_the_motion():
    step, late, w = 0.02, 0.013, np.array([0.3, -1.2, 0.8])
    t = np.arange(60) * step

    def states(time):
        angle = np.sin(9.0 * time)[:, None]
        q = Rotation.from_rotvec(angle * w / 2.0).as_quat()[:, [3, 0, 1, 2]]
        p = np.column_stack([np.cos(9.0 * time), 0.0 * time, time])
        spin = 9.0 * np.cos(9.0 * time)[:, None] * w / 2.0
        v = np.column_stack([-9.0 * np.sin(9.0 * time), 0.0 * time, 1.0 + 0.0 * time])
        return np.hstack([q, p, spin, v])

    turns, places = earlier(states(t), step, late)
    true = states(t - late)
    off = turns.inv() * Rotation.from_quat(true[:, [1, 2, 3, 0]])
    assert np.max(off[1:].magnitude()) < HERMITE_TOLERANCE
    assert np.max(np.abs(places[1:] - true[1:, 4:7])) < HERMITE_TOLERANCE


def test_steps_for_slopes_stay_within_bounds():
    """A retardation time near zero would become negative, which no cable has."""
    x, least, largest = np.array([[1e-7, 0.5, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    down, up = steps_within(x, least, largest)
    assert down == pytest.approx([1e-7, SMALL, SMALL])
    assert up == pytest.approx([SMALL, SMALL, 0.0])
    assert np.all(x - down >= least)
    assert np.all(x + up <= largest)


@pytest.mark.parametrize("f", [0.83, 1.9, 7.3])
def test_dominant_frequency_is_that_of_a_sine(f):
    t = np.arange(300) / 50.0
    values = 3.0 + np.exp(-0.2 * t) * np.sin(2.0 * np.pi * f * t + 0.3)
    assert dominant_frequency(t, values) == pytest.approx(f, rel=2e-3)


# Behaviours of cables, contacts, load cells.

RUBBING = swings.TRUE["hysteresis"]

FIRST_STEP = 0.02
"""Share by which a rate over two milliseconds is another than at their beginning: contacts move by
a hundredth of what they are bent by."""

BENT = np.array([-0.8, 0.7, -0.9])
"""Where contacts are when the log begins, as shares of the slip: against the velocity."""


def swing(model, vector):
    """A noisy log of a swing from where elastic cables of these lengths hold the platform."""
    l0, cables = model.lengths(vector), model.robot.cables
    rest = equilibrium_near(cables, ELASTIC, model.platform(vector), l0, START).X_WP
    turn = Rotation.from_matrix((rest.rotation() @ START.rotation().inverse()).matrix())
    shift = rest.translation() - START.translation()
    moved = [turn.as_rotvec(), shift, swings.push(rest, cables), BENT[: model.memory]]
    states, tensions = model.run(vector, np.concatenate(moved), COUNT, 1.0 / RATE)
    cells = model.sensed_tensions(vector, tensions)
    return swings.noisy(states, cells, np.random.default_rng(0))


def check_found(true, motion):
    """That these values are found, and told."""
    assert 0.85 < motion.spread < 1.15
    assert np.max(np.abs(swings.off_by(true, motion))) < SIGMAS
    std = {u.name: s for u, s in zip(motion.unknowns, motion.std, strict=True)}
    for name, value in true.items():
        assert std[name] < 0.5 * abs(value), f"{name} is not told"


@pytest.mark.parametrize("group", ["hysteresis", "stiffening", "creep"])
def test_what_the_plant_swung_with_is_found(group):
    motion = swings.identified(group, 0)
    check_found(swings.TRUE[group], motion)
    by_name = {one.name: x for one, x in zip(motion.unknowns, motion.values, strict=True)}
    assert ("rests beside its pose" in " ".join(motion.remarks)) == (group == "hysteresis")
    robot = swung_robot(soft(), motion)
    rubs, does = robot.platform.hysteresis, robot.cable_behaviour()
    assert (rubs is not None) == (group == "hysteresis")
    if rubs is not None:  # the file holds what was found, and a fit begins there
        for name in ("tilt", "turn", "slip"):
            assert getattr(rubs, name) == by_name[f"hysteresis.{name}"]
        again = model_of("hysteresis", robot=robot)
        assert again.by_name(again.before())["hysteresis.tilt"] == rubs.tilt
    for name in ("stiffening", "creep_stiffness"):
        assert getattr(does, name) == pytest.approx(by_name.get(f"all.{name}", 0.0))


def test_scale_and_zeros_of_load_cells_are_found():
    groups = ("load_cells", "load_cell_zeros")
    true = {"load_cells.scale": 0.94, "C1.load_cell_zero": 3.0, "C3.load_cell_zero": -4.0}
    model = model_of(*groups)
    motion = swings.fitted(soft(), groups, swing(model, changed(model, true)))
    check_found(true, motion)
    assert "rests beside its pose" not in " ".join(motion.remarks)
    assert swung_robot(soft(), motion).platform.hysteresis is None


def test_no_behaviour_is_unknown_unless_it_is_named():
    model = model_of(*FREE_GROUPS)
    assert {u.group for u in model.unknowns} == {*FREE_GROUPS, "", "sensor"}
    assert model.first() == pytest.approx(np.zeros(len(model.names)))


def test_contacts_begin_where_they_are_said_to_be():
    model = model_of("hysteresis")
    vector = changed(model, RUBBING)
    assert model.memory == 3
    moved = np.concatenate([np.zeros(6), [0.6, -0.3, 0.9], np.zeros(3)])
    bent = usually_bent(np.array([1.0] + 6 * [0.0]), moved[6:9])
    usual, again = (model.run(vector, m, 20, 0.02)[0] for m in (moved, np.append(moved, bent)))
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
    cells = model.sensed_tensions(vector, pulls)
    np.testing.assert_allclose(model.unsensed_tensions(vector, cells), pulls, atol=1e-12)
    assert cells[0, 3] == pytest.approx(model.by_name(vector)["C4.load_cell_zero"])


def test_what_is_known_beforehand_weighs_and_counts():
    known = model_of(*FREE_GROUPS).knowing({"mass": 0.1}).unknowns
    assert [(u.name, u.size) for u in known if u.prior] == [("mass", 0.1)]
    with pytest.raises(IdentificationError, match=r"priors: mass: found -1; accepted: > 0 \[kg\]"):
        model_of(*FREE_GROUPS).knowing({"mass": -1.0})


def test_a_swing_tells_masses_and_forces_only_beside_what_load_cells_tell():
    model = model_of(*FREE_GROUPS, "hysteresis", "load_cells")
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
    cells = [model.sensed_tensions(v, t) for v, t in ((vector, pulls), (heavier, other))]
    np.testing.assert_allclose(cells[1], cells[0], atol=1e-6)


# What pulls beside cables and weight: nothing in a free swing, a hand where there is one.

HAND = 20.0
"""What one cable's load cell is told too much, as if a hand held against it [N]."""

NOISE = 0.08
"""Share of a pull: noise of positions makes some 1 N of the mean over half a second."""

WEIGHT = 12.992 * 9.80665


def stretch_of(model, log):
    return cut(model.robot, swing_log(soft(), log), [(0.0, (COUNT - 1) / RATE)])[0]


@pytest.fixture(scope="module")
def free():
    """A model, its vector, a free swing and its log."""
    model = model_of(*FREE_GROUPS)
    log = swing(model, model.before())
    return model, model.before(), stretch_of(model, log), log


def pulls_on(model, vector, stretch):
    return unexplained(model, vector, stretch, np.tile(START.translation(), (stretch.count, 1)))


@pytest.mark.parametrize("lengths", [False, True], ids=["tracker", "lengths"])
def test_nothing_pulls_at_a_platform_that_swings_freely(free, lengths):
    """Positions are a tracker's, or those by cable lengths."""
    model, vector, stretch, log = free
    if lengths:
        model = model_of(*FREE_GROUPS, lengths=True)
        turns = Rotation.from_quat(np.array([pose_row(X) for X in log.poses])[:, [1, 2, 3, 0]])
        log = replace(log, poses=None, tilts=turns.as_euler("ZYX")[:, ::-1])
        vector, stretch = model.before(), stretch_of(model, log)
    rest = pulls_on(model, vector, stretch)
    assert rest.largest(rest.force)[0] < PULLED * WEIGHT
    assert rest.largest(rest.moment)[0] < PULLED * WEIGHT * 0.3
    assert rest.time[-1] - rest.time[0] > PULL


def test_another_mass_shows_as_its_weight(free):
    model, vector, stretch, _ = free
    rest = pulls_on(model, vector + (np.array(model.names) == "mass"), stretch)
    assert rest.largest(rest.force)[0] == pytest.approx(9.80665, rel=0.3)  # and noise


def test_a_hand_shows_when_it_pulls_and_how_much(free):
    model, vector, stretch, log = free
    tensions = stretch.tensions.copy()
    tensions[20:50, 0] += HAND
    rest = pulls_on(model, vector, replace(stretch, tensions=tensions))
    force, at = rest.largest(rest.force)
    assert force == pytest.approx(HAND, rel=NOISE)
    assert stretch.time[20] - 0.1 < at < stretch.time[49] + 0.1
    # The hand holds against the cable, whose wrench is -J^T t.
    X = log.poses[35]
    by_cable = HAND * cable_paths(X, model.robot.cables).J[0]
    arm = X.rotation().matrix() @ model.robot.platform.p_PCo
    middle = slice(30 - 4, 40 - 4)  # without the four instants at the beginning
    np.testing.assert_allclose(np.mean(rest.force[middle], axis=0), by_cable[3:], atol=0.15 * HAND)
    moment = by_cable[:3] - np.cross(arm, by_cable[3:])
    np.testing.assert_allclose(np.mean(rest.moment[middle], axis=0), moment, atol=0.4)


def test_it_is_unknown_without_all_tensions(free):
    model, vector, stretch, _ = free
    tensions = stretch.tensions.copy()
    tensions[30, 2] = np.nan
    for lacking in (replace(stretch, tensions=tensions), stretch.first(0.1)):
        assert pulls_on(model, vector, lacking) is None


# Refusals.


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--stretches 5", "--stretches: found '5'; accepted: first:last, the first below the last"),
        ("--stretches 2:1", "--stretches: found '2:1'; accepted: first:last"),
        ("--stretches 0:90", "stretch: found 0:90; accepted: 0.5 s or more within 0 to 2.39 s"),
        ("--unknown friction", "unknown: found 'friction'; accepted of a free"),
        ("--lead -1", "--lead: found -1; accepted: > 0 [s]"),
        ("--prior turn=1", "--prior: found 'turn'; accepted: of what is unknown, mass"),
        ("--unknown stiffness --prior mass=0.1", "found 'mass'; accepted: of what is unknown, st"),
        ("--sigma turns=1", "--sigma: found 'turns'; did you mean turn?"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(tmp_path, capsys, options, words):
    log, out = tmp_path / "log.csv", tmp_path / "out"
    swings.write(log, (0,))
    said = refuse(capsys, "identify-swings", "irma4u", log, *options.split(), "--out", out)
    assert words in said
    assert not out.exists()


def test_winches_that_turn_and_a_mass_without_tensions_are_refused(tmp_path):
    path = tmp_path / "log.csv"
    swings.write(path, (0,), np.linspace(1.9, 1.95, 240)[:, None])
    with pytest.raises(IdentificationError, match=r"C1: found its length changing by 0\.0"):
        identify_swings("irma4u", path, stretches=[(0.0, 2.0)])
    lines = [",".join(row.split(",")[:4]) for row in path.read_text().splitlines()]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(IdentificationError, match="without which a free motion does not tell the"):
        identify_swings("irma4u", path, unknown="mass", stretches=[(0.0, 2.0)])


def test_a_search_stops_between_two_steps(tmp_path):
    swings.write(tmp_path / "log.csv", (0,))
    done, stops = [], iter([False] * 3)
    follow = Follow(lambda now: done.append(now.what), stop=lambda: next(stops, True))
    with pytest.raises(StoppedError):
        identify_swings("irma4u", tmp_path / "log.csv", stretches=[(0.0, 1.0)], follow=follow)
    assert done[1:] == 2 * ["first 0.6 s of each stretch"]
