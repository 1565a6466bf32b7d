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

ROUNDING = 1e-9
"""Of ends of rods, whose lengths and poses are given apart [m]."""

TWELVE_CHORDS = 5e-3
"""What twelve chords are shorter than a hanging cable, relative: a turn by 1.5 rad is 1.5^2 / 24 /
12^2 = 7e-4, and the tightest bend takes more of it."""


class Recorder:
    """Stands for Meshcat and keeps what it was told."""

    def __init__(self):
        self.objects = set()
        self.colors = []
        self.properties = {}
        self.transforms = {}
        self.times = {}
        self.visible = {}

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
        shown = [
            path.removeprefix(f"cables/{cable}/")
            for (path, name), value in self.properties.items()
            if name == "visible" and value and path.startswith(f"cables/{cable}/")
        ]
        assert len(shown) == 1
        rods, level = shown[0].split("/")
        return int(rods), int(level)

    def points(self, cable):
        """Ends of the visible rods of a cable, shape (rods, 2, 3)."""
        rods, level = self.shown(cable)
        ends = []
        for k in range(rods):
            rod = f"cables/{cable}/{rods}/{level}/{k}"
            assert f"{rod}/rod" in self.objects
            scale = self.properties[f"{rod}/rod", "scale"]
            half = np.array([[0, 0], [0, 0], [-scale[2] / 2, scale[2] / 2]])
            ends.append(self.transforms[rod].multiply(half).T)
        return np.array(ends)


@pytest.fixture
def robot():
    return load_robot("acrobot_small")


def lengths_at_home(robot, surplus):
    """Unstrained lengths, longer than the straight ways by surplus, shape (m,) [m]."""
    X_WP = robot.home.transform()
    return cable_lengths(X_WP, robot.exit_points(), robot.anchor_points()) + surplus


def test_slack_is_level_zero_and_colours_rise(robot):
    meshcat = Recorder()
    pictures = CablePictures(meshcat, robot, full_scale=8.0)
    tensions = np.array([0.0, 1e-9, 1.5, 3.0, 4.5, 7.9, 8.0, 99.0])
    pictures.draw(robot.home.transform(), tensions)
    levels = [meshcat.shown(cable.name) for cable in robot.cables]
    assert levels == [(1, level) for level in (0, 1, 2, 4, 5, 8, 8, 8)]
    pictures.draw(robot.home.transform(), np.zeros(8))
    assert [meshcat.shown(cable.name) for cable in robot.cables] == [(1, 0)] * 8


def test_cables_of_unknown_tension_are_grey(robot):
    meshcat, home = Recorder(), robot.home.transform()
    CablePictures(meshcat, robot, 10.0).draw(home, np.full(8, np.nan))
    assert [meshcat.shown(cable.name) for cable in robot.cables] == [(1, -1)] * 8
    assert all(color.r() == color.g() == color.b() for color in meshcat.colors)


def test_rod_reaches_from_exit_to_anchor_point(robot):
    meshcat = Recorder()
    X_WP = robot.home.transform()
    CablePictures(meshcat, robot, 10.0).draw(X_WP, np.ones(8))
    for cable in robot.cables:
        ends = meshcat.points(cable.name)[0]
        np.testing.assert_allclose(ends[0], cable.exit_point, atol=ROUNDING)
        np.testing.assert_allclose(ends[1], X_WP.multiply(cable.anchor_point), atol=ROUNDING)


def test_slack_cables_hang_with_their_surplus(robot):
    meshcat = Recorder()
    surplus = np.array([0.05, -1e-4, 0.0, 0.02, -1e-4, 0.0, 0.1, -1e-4])
    l0 = lengths_at_home(robot, surplus)
    tensions = np.where(surplus < 0.0, 1.0, 0.0)
    CablePictures(meshcat, robot, 10.0).draw(robot.home.transform(), tensions, None, l0)
    for i, cable in enumerate(robot.cables):
        points = meshcat.points(cable.name)
        np.testing.assert_allclose(points[1:, 0], points[:-1, 1], atol=ROUNDING)
        if surplus[i] <= 0.0:
            assert len(points) == 1
            continue
        drawn = np.sum(np.linalg.norm(points[:, 1] - points[:, 0], axis=1))
        assert drawn == pytest.approx(l0[i], rel=TWELVE_CHORDS)


def test_catenaries_sag_and_keep_the_colour_of_their_tension():
    robot, meshcat = load_robot("caroca"), Recorder()
    settings = CableSettings(model="catenary", pulleys=True)
    l0 = lengths_at_home(robot, 0.25)
    pictures = CablePictures(meshcat, robot, 100.0, settings=settings)
    pictures.draw(robot.home.transform(), np.full(8, 90.0), None, l0)
    for cable in robot.cables:
        rods, level = meshcat.shown(cable.name)
        assert rods > 12  # the free part, and the groove
        assert level == 8
        np.testing.assert_allclose(
            meshcat.points(cable.name)[0, 0], cable.exit_point, atol=ROUNDING
        )
    # Less than their weight: they hang.
    pictures.draw(robot.home.transform(), np.full(8, 1.0), None, l0)
    assert {meshcat.shown(cable.name)[1] for cable in robot.cables} == {0}


def test_a_chain_made_during_a_recording_is_hidden_before(robot):
    meshcat = Recorder()
    pictures = CablePictures(meshcat, robot, 10.0)
    X_WP = robot.home.transform()
    pictures.draw(X_WP, np.full(8, 1.0), 0.0)
    pictures.draw(X_WP, np.full(8, 9.0), 1.0)
    assert meshcat.visible["cables/C1/1/1"] == [(None, False), (0.0, True), (1.0, False)]
    assert meshcat.visible["cables/C1/1/8"] == [(None, False), (0.0, False), (1.0, True)]


def test_a_recording_keeps_what_moves_and_when_it_began_to(robot):
    meshcat = Recorder()
    pictures = CablePictures(meshcat, robot, 10.0)
    home = robot.home.transform()
    for time in (0.0, 1.0, 2.0):
        pictures.draw(home, np.ones(8), time)
    assert meshcat.times["cables/C1/1/1/0"] == [0.0]
    aside = RigidTransform([0.0, 0.0, 0.05]) @ home
    pictures.draw(aside, np.ones(8), 3.0)
    assert meshcat.times["cables/C1/1/1/0"] == [0.0, 2.0, 3.0]
    end = meshcat.points("C1")[0, 1]
    np.testing.assert_allclose(end, aside.multiply(robot.cables[0].anchor_point), atol=ROUNDING)


def test_system_draws_while_a_simulation_runs(robot):
    meshcat = open_meshcat()
    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", CableRobot(robot))
    drawing = builder.AddNamedSystem(
        "pictures", MeshcatCables(CablePictures(meshcat, robot, 5.0), 8)
    )
    for name in ("X_WP", "tensions", "unstrained_lengths"):
        builder.Connect(block.GetOutputPort(name), drawing.GetInputPort(name))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    block.set_at_equilibrium(block.GetMyMutableContextFromRoot(context), robot.home.transform())
    Simulator(diagram, context).AdvanceTo(0.02)
    assert meshcat.HasPath("cables/C1")


def test_cables_of_a_robot_that_changes_move_with_the_rods_that_are_there():
    robot, moved = load_robot("acrobot_small"), load_robot("acrobot_small")
    home, tensions = robot.home.transform(), np.full(8, 5.0)
    recorder, full_scale = Recorder(), 60.0
    pictures = CablePictures(recorder, robot, full_scale)
    pictures.draw(home, tensions)
    made = len(recorder.colors)
    moved.cables[1].exit_point = moved.cables[1].exit_point + np.array([0.1, 0.0, 0.0])
    assert pictures.move_to(moved, full_scale)
    pictures.draw(home, tensions)
    assert len(recorder.colors) == made
    start = recorder.points(moved.cables[1].name)[0, 0]
    np.testing.assert_allclose(start, moved.cable_set().p_WA[:, 1], atol=ROUNDING)


@pytest.mark.parametrize("change", ["name", "diameter", "count", "scale"])
def test_cables_that_look_otherwise_are_made_anew(change):
    robot, other = load_robot("acrobot_small"), load_robot("acrobot_small")
    pictures, full_scale = CablePictures(Recorder(), robot, 60.0), 60.0
    if change == "name":
        other.cables[0].name = "other"
    elif change == "diameter":
        other.cable.diameter = 0.05
    elif change == "count":
        del other.cables[-1]
    else:
        full_scale = 30.0
    assert not pictures.move_to(other, full_scale)
