"""A platform that rubs rests at no one pose: how far beside, in words, numbers and pictures."""

from dataclasses import replace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.simulation.behaviour_loops import loop_figure, shows_loops
from cdpr_drake.analyses.statics.robot_at_rest import static_at_lengths, static_at_pose
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_schema import HysteresisSettings
from tests.cli.commands import refuse
from tests.figure_faults import figure_faults
from tests.motion.small_robots import small_robot

WIDEST = 12.0
"""Of a figure whose letters are read where it is shown 690 px wide [inch]."""

CONTACTS = {"tilt": 0.3, "turn": 0.5, "slip": 0.02}


def rubbing(robot, **more):
    section = HysteresisSettings(**(CONTACTS | more))
    return replace(robot, platform=replace(robot.platform, hysteresis=section))


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


def lengths_at_home(robot):
    return cable_paths(robot.home.transform(), robot.cable_set()).lengths


def at_rest(robot):
    """At its home pose, or where it hangs with such lengths."""
    if robot.is_underactuated():
        return static_at_lengths(robot, lengths_at_home(robot), "elastic", True)
    return static_at_pose(robot, robot.home.transform(), "elastic", True)


@pytest.mark.parametrize("name", ["hanging_four", "oblique_body"])
def test_it_may_rest_as_far_as_its_stiffness_lets_contacts_hold_it(name):
    """Each bent contact is put on as a moment, and the platform's turn by its stiffness found."""
    robot = rubbing(small_robot(name))
    report = at_rest(robot)
    X_WP = report.X_WP
    R, motion = X_WP.rotation().matrix(), robot.motion_type()
    most = 0.0
    for z in np.vstack([np.eye(3), -np.eye(3), np.random.default_rng(1).normal(size=(500, 3))]):
        bent = CONTACTS["slip"] * z / np.linalg.norm(z)
        moment = R @ (np.array([0.3, 0.3, 0.5]) * bent)
        force = motion.components(np.concatenate([moment, np.zeros(3)]), R)
        moved = motion.twist(np.linalg.solve(report.stiffness, force), R)
        most = max(most, float(np.linalg.norm(moved[:3])))
    assert report.contacts[0] == pytest.approx(most, rel=0.02)
    assert report.contacts[0] >= most * (1.0 - 1e-9)
    np.testing.assert_allclose(report.contacts[1:], 0.02 * np.array([0.3, 0.3, 0.5]))
    assert at_rest(small_robot(name)).contacts is None


def test_a_rest_that_is_not_unique_says_so(capsys, tmp_path):
    robot = rubbing(small_robot("hanging_four"))
    rest = cdpr.solve_static(robot, lengths=lengths_at_home(robot))
    assert rest.as_dict()["rests_within_rad"] > 0.0
    assert rest.as_dict()["held_moments_n_m"] == pytest.approx([0.006, 0.006, 0.01])
    words = "rest is not unique: contacts hold moments up to (0.006, 0.006, 0.01) N m"
    assert words in repr(rest)
    plain = ("static", "acrobot_small", "--plot", f"behaviour={tmp_path / 'none.png'}")
    assert "accepted: cable.behaviour or platform.hysteresis" in refuse(capsys, *plain)
    assert not list(tmp_path.iterdir())


def test_the_picture_has_what_the_file_has():
    robot = cdpr.load_robot("irma4u")
    with pytest.raises(CableModelError, match="elastic cables alone"):
        cdpr.solve_static(robot).plot("behaviour")
    behaviour = BehaviourSettings(
        stiffening=5e-3, sheave_friction=0.05, creep_stiffness=0.3, creep_time=0.3
    )
    robot = rubbing(replace(robot, cable=replace(robot.cable, behaviour=behaviour)))
    report = cdpr.solve_static(robot)
    figure = report.plot("behaviour")
    assert figure_faults(figure) == []
    cables, drums, contacts = figure.axes
    assert figure.get_figwidth() < WIDEST
    for axes in figure.axes:
        assert "[" in axes.get_xlabel()
        assert "[N" in axes.get_ylabel()
        assert axes.get_legend() is not None
    # The drawn loop of creep encloses what its words say.
    loop = next(line for line in cables.lines if "creep takes" in line.get_label())
    x, y = np.array(loop.get_data())
    area = abs(float(np.trapezoid(y, x))) / 100.0
    assert f"{area:.3g} J/m" in loop.get_label()
    loop = next(line for line in contacts.lines if line.get_label().startswith("turn"))
    x, y = np.array(loop.get_data())
    assert f"{abs(float(np.trapezoid(y, np.radians(x)))):.3g} J" in loop.get_label()
    marks = next(line for line in drums.lines if "at this pose" in line.get_label())
    k = [cable.name for cable in robot.cables].index(marks.get_label().split()[0])
    np.testing.assert_allclose(marks.get_ydata(), report.drums[:, k])


def test_loops_of_a_run_are_those_of_its_log():
    """A platform that was turned one way and back: the moments of its contacts, by Dahl."""
    robot = rubbing(small_robot("hanging_four"))
    assert shows_loops(robot)
    assert not shows_loops(small_robot("hanging_four"))
    s = np.concatenate([np.linspace(0.0, 0.2, 50), np.linspace(0.2, -0.1, 50)[1:]])
    X_WP = np.zeros((len(s), 7))
    X_WP[:, 0], X_WP[:, 3] = np.cos(s / 2.0), np.sin(s / 2.0)
    log = {"X_WP": X_WP, "tensions": np.ones((len(s), 4)), "lengths": np.ones((len(s), 4)),
           "unstrained_lengths": np.full((len(s), 4), 0.999)}  # fmt: skip
    figure = loop_figure("A run", robot, log)
    line = next(each for each in figure.axes[0].lines if each.get_label() == "about z of P")
    x, y = line.get_data()
    contacts, K = robot.contact_hysteresis(), 0.5
    top = contacts.bent(0.2)
    assert np.max(y) == pytest.approx(K * top, rel=1e-9)
    # On the way back z -> -a + (a + z) exp(-way / a).
    last = -contacts.slip + (contacts.slip + top) * np.exp(-0.3 / contacts.slip)
    assert y[-1] == pytest.approx(K * last, rel=1e-9)
    assert x[-1] == pytest.approx(np.degrees(-0.1))
