"""Cables in Meshcat: one chain of rods visible at a time, red when slack, where the cable runs."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.monitoring.meshcat_cables import CablePictures, MeshcatCables
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableSettings

ROUNDING = 1e-9  # of ends of rods, whose lengths and poses are given apart [m]
TWELVE_CHORDS = 5e-3
"""What twelve chords are shorter than a hanging cable, relative: a turn by 1.5 rad is 1.5^2 / 24 /
12^2 = 7e-4, and the tightest bend takes more of it."""

ROBOT = load_robot("acrobot_small")
HOME, NAMES = ROBOT.home.transform(), [cable.name for cable in ROBOT.cables]


class Recorder:
    """Stands for Meshcat and keeps what it was told."""

    def __init__(self):
        self.objects, self.colors = set(), []
        self.properties, self.transforms, self.times, self.visible = {}, {}, {}, {}

    def SetObject(self, path, shape, rgba):
        self.objects.add(path)
        self.colors.append(rgba)

    def SetTransform(self, path, X, time=None):
        self.transforms[path] = X
        self.times.setdefault(path, []).append(time)

    def SetProperty(self, path, name, value, time=None):
        self.properties[path, name] = value
        if name == "visible":
            self.visible.setdefault(path, []).append((time, value))

    def shown(self, cable):
        """Number of rods and colour of the one chain of a cable that is visible."""
        (chain,) = (
            path.removeprefix(f"cables/{cable}/")
            for (path, name), value in self.properties.items()
            if name == "visible" and value and path.startswith(f"cables/{cable}/")
        )
        rods, level = chain.split("/")
        return int(rods), int(level)

    def points(self, cable):
        """Ends of the visible rods of a cable, shape (rods, 2, 3)."""
        rods, level = self.shown(cable)
        ends = []
        for k in range(rods):
            rod = f"cables/{cable}/{rods}/{level}/{k}"
            assert f"{rod}/rod" in self.objects
            length = self.properties[f"{rod}/rod", "scale"][2]
            half = np.array([[0, 0], [0, 0], [-length / 2, length / 2]])
            ends.append(self.transforms[rod].multiply(half).T)
        return np.array(ends)


@pytest.fixture
def meshcat():
    return Recorder()


@pytest.fixture
def pictures(meshcat):
    return CablePictures(meshcat, ROBOT, 8.0)


def lengths_at_home(robot, surplus):
    """Unstrained lengths, longer than the straight ways by surplus, shape (m,) [m]."""
    X_WP = robot.home.transform()
    return cable_lengths(X_WP, robot.exit_points(), robot.anchor_points()) + surplus


def test_slack_is_level_zero_colours_rise_and_unknown_tension_is_grey(pictures, meshcat):
    unknown, few = np.full(8, np.nan), np.array([0.0, 1e-9, 1.5, 3.0, 4.5, 7.9, 8.0, 99.0])
    pictures.draw(HOME, unknown)
    assert [meshcat.shown(name) for name in NAMES] == [(1, -1)] * 8
    assert all(color.r() == color.g() == color.b() for color in meshcat.colors)
    for tensions, levels in ((few, (0, 1, 2, 4, 5, 8, 8, 8)), (np.zeros(8), (0,) * 8)):
        pictures.draw(HOME, tensions)
        assert [meshcat.shown(name) for name in NAMES] == [(1, level) for level in levels]
    for cable in ROBOT.cables:  # a rod reaches from exit to anchor point
        ends = cable.exit_point, HOME.multiply(cable.anchor_point)
        np.testing.assert_allclose(meshcat.points(cable.name)[0], ends, atol=ROUNDING)


def test_slack_cables_hang_with_their_surplus(pictures, meshcat):
    surplus = np.array([0.05, -1e-4, 0.0, 0.02, -1e-4, 0.0, 0.1, -1e-4])
    l0 = lengths_at_home(ROBOT, surplus)
    pictures.draw(HOME, np.where(surplus < 0.0, 1.0, 0.0), None, l0)
    for name, more, length in zip(NAMES, surplus, l0, strict=True):
        points = meshcat.points(name)
        np.testing.assert_allclose(points[1:, 0], points[:-1, 1], atol=ROUNDING)
        if more <= 0.0:
            assert len(points) == 1
        else:
            drawn = np.sum(np.linalg.norm(points[:, 1] - points[:, 0], axis=1))
            assert drawn == pytest.approx(length, rel=TWELVE_CHORDS)


def test_catenaries_sag_and_keep_the_colour_of_their_tension(meshcat):
    robot = load_robot("caroca")
    settings = CableSettings(model="catenary", pulleys=True)
    pictures = CablePictures(meshcat, robot, 100.0, settings=settings)
    l0 = lengths_at_home(robot, 0.25)
    for tension, level in ((90.0, 8), (1.0, 0)):  # less than their weight: they hang
        pictures.draw(robot.home.transform(), np.full(8, tension), None, l0)
        for cable in robot.cables:
            rods, shown = meshcat.shown(cable.name)
            assert rods > 12  # the free part, and the groove
            assert shown == level
            start = meshcat.points(cable.name)[0, 0]
            np.testing.assert_allclose(start, cable.exit_point, atol=ROUNDING)


def test_a_recording_keeps_what_moves_when_it_began_to_and_hides_a_chain_before_it_is_made(
    pictures, meshcat
):
    for time in (0.0, 1.0, 2.0):
        pictures.draw(HOME, np.full(8, 0.8), time)
    assert meshcat.times["cables/C1/1/1/0"] == [0.0]
    aside = RigidTransform([0.0, 0.0, 0.05]) @ HOME
    pictures.draw(aside, np.full(8, 0.8), 3.0)
    assert meshcat.times["cables/C1/1/1/0"] == [0.0, 2.0, 3.0]
    anchor = aside.multiply(ROBOT.cables[0].anchor_point)
    np.testing.assert_allclose(meshcat.points("C1")[0, 1], anchor, atol=ROUNDING)
    pictures.draw(HOME, np.full(8, 9.0), 4.0)
    assert meshcat.visible["cables/C1/1/1"] == [(None, False), (0.0, True), (4.0, False)]
    assert meshcat.visible["cables/C1/1/8"] == [(None, False), (0.0, False), (4.0, True)]


def test_the_system_draws_while_a_simulation_runs():
    meshcat, builder = open_meshcat(), DiagramBuilder()
    block = builder.AddNamedSystem("robot", CableRobot(ROBOT))
    drawing = MeshcatCables(CablePictures(meshcat, ROBOT, 5.0), 8)
    builder.AddNamedSystem("pictures", drawing)
    for name in ("X_WP", "tensions", "unstrained_lengths"):
        builder.Connect(block.GetOutputPort(name), drawing.GetInputPort(name))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    block.set_at_equilibrium(block.GetMyMutableContextFromRoot(context), HOME)
    Simulator(diagram, context).AdvanceTo(0.02)
    assert meshcat.HasPath("cables/C1")


def test_cables_of_a_robot_that_changes_move_with_the_rods_that_are_there(pictures, meshcat):
    moved, tensions = load_robot("acrobot_small"), np.full(8, 5.0)
    pictures.draw(HOME, tensions)
    made = len(meshcat.colors)
    moved.cables[1].exit_point = moved.cables[1].exit_point + np.array([0.1, 0.0, 0.0])
    assert pictures.move_to(moved, 8.0)
    pictures.draw(HOME, tensions)
    assert len(meshcat.colors) == made
    start = meshcat.points(moved.cables[1].name)[0, 0]
    np.testing.assert_allclose(start, moved.cable_set().p_WA[:, 1], atol=ROUNDING)


OTHERWISE = {
    "name": lambda robot: setattr(robot.cables[0], "name", "other"),
    "diameter": lambda robot: setattr(robot.cable, "diameter", 0.05),
    "count": lambda robot: robot.cables.pop(),
    "scale": lambda robot: None,
}


@pytest.mark.parametrize("change", OTHERWISE)
def test_cables_that_look_otherwise_are_made_anew(change, pictures):
    other = load_robot("acrobot_small")
    OTHERWISE[change](other)
    assert not pictures.move_to(other, 4.0 if change == "scale" else 8.0)
