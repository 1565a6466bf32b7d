"""Robots at rest on cables that stiffen, are warm, or rub, and on contacts that rub: numbers, words
and pictures."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.runs.subjects import BEHAVIOUR, loop_figure
from cdpr_drake.cables.cable_behaviour import tension_of_strain
from cdpr_drake.cables.models import check_model
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_from_angles, rotation_from_angles
from cdpr_drake.models.cable_schema import BehaviourSettings
from cdpr_drake.models.platform_schema import HysteresisSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.settings import CableSettings
from tests.cli.commands import refuse
from tests.figure_faults import figure_faults
from tests.motion.small_robots import small_robot

STIFFENING, EXPANSION, WARMER, FRICTION = 2e-3, 1.2e-5, 12.0, 0.03

FORCE_TOLERANCE = 1e-6
"""Of tensions that follow from lengths, relative: lengths are exact to 1e-12 m of 1e-3 m."""

WIDEST = 12.0
"""Of a figure whose letters are read where it is shown 690 px wide [inch]."""

CONTACTS = {"tilt": 0.3, "turn": 0.5, "slip": 0.02}


def behaving(name="acrobot_large", **behaviour):
    """A robot with a section `cable.behaviour`."""
    robot = load_robot(name)
    return replace(robot, cable=replace(robot.cable, behaviour=BehaviourSettings(**behaviour)))


def rubbing(robot):
    """A robot with a section `platform.hysteresis`."""
    return replace(
        robot, platform=replace(robot.platform, hysteresis=HysteresisSettings(**CONTACTS))
    )


def test_counted_lengths_give_the_tensions_by_the_law():
    robot = behaving(stiffening=STIFFENING, expansion=EXPANSION, warmer=WARMER)
    rest, plain = cdpr.solve_static(robot), cdpr.solve_static("acrobot_large")
    np.testing.assert_allclose(rest.tensions, plain.tensions, rtol=1e-9)
    strains = rest.lengths / (rest.l0 * (1.0 + EXPANSION * WARMER)) - 1.0
    by_law = tension_of_strain(strains, robot.stiffness(), STIFFENING)
    np.testing.assert_allclose(by_law, rest.tensions, rtol=FORCE_TOLERANCE)
    # Stiffer cables under tension: every mode is faster.
    assert np.all(rest.frequencies > plain.frequencies)
    # The lengths lead back to it.
    again = cdpr.solve_static(robot, lengths=rest.l0)
    assert np.linalg.norm(again.X_WP.translation() - rest.X_WP.translation()) < 1e-8
    np.testing.assert_allclose(again.tensions, rest.tensions, rtol=1e-5)
    np.testing.assert_allclose(again.stiffness, rest.stiffness, rtol=1e-5, atol=1e-2)
    np.testing.assert_array_equal(again.l0, rest.l0)


def test_sheaves_show_between_winding_up_and_paying_out():
    robot = behaving("irma4u", sheave_friction=FRICTION)
    rest = cdpr.solve_static(robot, pose_from_angles(np.array([0.0, 0.0, 0.4]), np.zeros(3)))
    answer = rest.as_dict()
    up = np.array(answer["drum_tensions_winding_up_n"])
    down = np.array(answer["drum_tensions_paying_out_n"])
    cables = robot.cable_set()
    wraps = cable_paths(rest.X_WP, cables).arcs / cables.pulley_radius
    assert np.all(wraps > 1.0)
    np.testing.assert_allclose(np.log(up / down), 2.0 * FRICTION * wraps, rtol=1e-9)
    np.testing.assert_allclose(np.sqrt(up * down), rest.tensions, rtol=1e-9)
    assert "tensions at the drums while cable is wound up [N]:" in repr(rest)
    without = cdpr.solve_static(robot, [0.0, 0.0, 0.4], pulleys=False)
    assert "sheave_friction 0.03 of irma4u does nothing without pulleys" in repr(without)


def test_off_is_the_same_to_the_bit():
    zeros = behaving(stiffening=0.0)
    a, b = cdpr.solve_static(zeros).as_dict(), cdpr.solve_static("acrobot_large").as_dict()
    assert json.dumps(a) == json.dumps(b)
    assert CableSettings().cable_set(zeros).count == 8


def test_models_that_do_not_go_with_a_behaviour_say_so():
    robot = behaving(stiffening=STIFFENING)
    with pytest.raises(CableModelError, match="found catenary for cables that stiffen or are warm"):
        cdpr.solve_static(robot, model="catenary")
    with pytest.raises(CableModelError, match="found catenary for cables with a behaviour"):
        check_model("catenary", CableSettings().cable_set(robot))


def test_no_held_moment_turns_the_platform_further():
    random = np.random.default_rng(5)
    C = random.normal(size=(3, 3))
    C, R = C @ C.T, rotation_from_angles(random.normal(size=3)).matrix()
    contacts = ContactHysteresis(**CONTACTS)
    z = random.normal(size=(3, 200_000))
    z *= contacts.slip / np.linalg.norm(z, axis=0)
    turns = np.linalg.norm(C @ R @ (contacts.stiffness()[:, None] * z), axis=0)
    assert np.max(turns) <= contacts.turns_of_rest(C, R) * (1.0 + 1e-12)
    assert np.max(turns) > 0.999 * contacts.turns_of_rest(C, R)


def at_rest(robot):
    """At its home pose, or where it hangs with such lengths."""
    if robot.is_underactuated():
        lengths = cable_paths(robot.home.transform(), robot.cable_set()).lengths
        return cdpr.solve_static(robot, lengths=lengths)
    return cdpr.solve_static(robot)


@pytest.mark.parametrize("name", ["hanging_four", "oblique_body"])
def test_it_may_rest_as_far_as_its_stiffness_lets_contacts_hold_it(name):
    """Each bent contact is put on as a moment, and the platform's turn by its stiffness found."""
    rest = at_rest(rubbing(small_robot(name)))
    R, motion = rest.X_WP.rotation().matrix(), rest.robot.motion_type()
    most = 0.0
    for z in np.vstack([np.eye(3), -np.eye(3), np.random.default_rng(1).normal(size=(500, 3))]):
        bent = CONTACTS["slip"] * z / np.linalg.norm(z)
        moment = R @ (np.array([0.3, 0.3, 0.5]) * bent)
        force = motion.components(np.concatenate([moment, np.zeros(3)]), R)
        moved = motion.twist(np.linalg.solve(rest.stiffness, force), R)
        most = max(most, float(np.linalg.norm(moved[:3])))
    assert rest.contacts[0] == pytest.approx(most, rel=0.02)
    assert rest.contacts[0] >= most * (1.0 - 1e-9)
    np.testing.assert_allclose(rest.contacts[1:], 0.02 * np.array([0.3, 0.3, 0.5]))
    assert rest.as_dict()["rests_within_rad"] == rest.contacts[0] > 0.0
    assert rest.as_dict()["held_moments_n_m"] == pytest.approx([0.006, 0.006, 0.01])
    assert "contacts hold moments up to (0.006, 0.006, 0.01) N m" in repr(rest)
    assert at_rest(small_robot(name)).contacts is None


def test_a_file_without_a_behaviour_has_no_picture_of_it(capsys, tmp_path):
    line = ("static", "acrobot_small", "--plot", f"behaviour={tmp_path / 'none.png'}")
    assert "accepted: cable.behaviour or platform.hysteresis" in refuse(capsys, *line)
    assert not list(tmp_path.iterdir())
    with pytest.raises(CableModelError, match="elastic cables alone"):
        cdpr.solve_static("irma4u").plot("behaviour")


def labelled(axes, words):
    """Line of a panel whose label has these words."""
    return next(line for line in axes.lines if words in line.get_label())


def test_the_picture_has_what_the_file_has():
    behaviour = {"stiffening": 5e-3, "sheave_friction": 0.05, "creep_stiffness": 0.3,
                 "creep_time": 0.3}  # fmt: skip
    rest = cdpr.solve_static(rubbing(behaving("irma4u", **behaviour)))
    figure = rest.plot("behaviour")
    assert figure_faults(figure) == []
    cables, drums, contacts = figure.axes
    assert figure.get_figwidth() < WIDEST
    for axes in figure.axes:
        assert "[" in axes.get_xlabel()
        assert "[N" in axes.get_ylabel()
        assert axes.get_legend() is not None
    # The drawn loop of creep encloses what its words say.
    loop = labelled(cables, "creep takes")
    x, y = np.array(loop.get_data())
    assert f"{abs(float(np.trapezoid(y, x))) / 100.0:.3g} J/m" in loop.get_label()
    loop = labelled(contacts, "turn: ")
    x, y = np.array(loop.get_data())
    assert f"{abs(float(np.trapezoid(y, np.radians(x)))):.3g} J" in loop.get_label()
    marks = labelled(drums, "at this pose")
    k = rest.names.index(marks.get_label().split()[0])
    np.testing.assert_allclose(marks.get_ydata(), rest.drums[:, k])


def test_loops_of_a_run_are_those_of_its_log():
    """A platform that was turned one way and back: the moments of its contacts, by Dahl."""
    robot = rubbing(small_robot("hanging_four"))
    assert BEHAVIOUR.applies(SimpleNamespace(robot=robot))
    assert not BEHAVIOUR.applies(SimpleNamespace(robot=small_robot("hanging_four")))
    s = np.concatenate([np.linspace(0.0, 0.2, 50), np.linspace(0.2, -0.1, 50)[1:]])
    X_WP = np.zeros((len(s), 7))
    X_WP[:, 0], X_WP[:, 3] = np.cos(s / 2.0), np.sin(s / 2.0)
    log = {"X_WP": X_WP, "tensions": np.ones((len(s), 4)), "lengths": np.ones((len(s), 4)),
           "unstrained_lengths": np.full((len(s), 4), 0.999)}  # fmt: skip
    run = SimpleNamespace(robot=robot, log=log, title=str)
    x, y = labelled(loop_figure(run).axes[0], "about z of P").get_data()
    contacts, K = robot.contact_hysteresis(), 0.5
    top = contacts.bent(0.2)
    assert np.max(y) == pytest.approx(K * top, rel=1e-9)
    # On the way back z -> -a + (a + z) exp(-way / a).
    last = -contacts.slip + (contacts.slip + top) * np.exp(-0.3 / contacts.slip)
    assert y[-1] == pytest.approx(K * last, rel=1e-9)
    assert x[-1] == pytest.approx(np.degrees(-0.1))
