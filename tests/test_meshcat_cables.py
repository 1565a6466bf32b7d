"""Cables in Meshcat: one colour visible at a time, red when slack, posed and scaled."""

import numpy as np
import pytest
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.models import load_robot
from cdpr_drake.systems import CablePictures, CableRobot, MeshcatCables
from cdpr_drake.systems.meshcat_cables import TENSION_COLORS


class Recorder:
    """Stands for Meshcat and keeps what it was told."""

    def __init__(self):
        self.properties = {}
        self.transforms = {}

    def SetObject(self, path, shape, rgba):
        pass

    def SetTransform(self, path, X, time=None):
        self.transforms[path] = X

    def SetProperty(self, path, name, value, time=None):
        self.properties[path, name] = value


@pytest.fixture
def robot():
    return load_robot("acrobot_small")


def visible_level(meshcat, cable):
    shown = [
        level
        for level in range(len(TENSION_COLORS) + 1)
        if meshcat.properties[f"cables/{cable}/rod/{level}", "visible"]
    ]
    assert len(shown) == 1
    return shown[0]


def test_slack_is_level_zero_and_colours_rise(robot):
    meshcat = Recorder()
    pictures = CablePictures(meshcat, robot, full_scale=8.0)
    tensions = np.array([0.0, 1e-9, 1.5, 3.0, 4.5, 7.9, 8.0, 99.0])
    pictures.draw(robot.home.transform(), tensions)
    levels = [visible_level(meshcat, cable.name) for cable in robot.cables]
    assert levels == [0, 1, 2, 4, 5, 8, 8, 8]
    pictures.draw(robot.home.transform(), np.zeros(8))
    assert [visible_level(meshcat, cable.name) for cable in robot.cables] == [0] * 8


def test_rod_reaches_from_exit_to_anchor_point(robot):
    meshcat = Recorder()
    X_WP = robot.home.transform()
    CablePictures(meshcat, robot, 10.0).draw(X_WP, np.ones(8))
    for cable in robot.cables:
        X = meshcat.transforms[f"cables/{cable.name}"]
        scale = meshcat.properties[f"cables/{cable.name}/rod", "scale"]
        ends = X.multiply(np.array([[0, 0], [0, 0], [-scale[2] / 2, scale[2] / 2]]))
        np.testing.assert_allclose(ends[:, 0], cable.exit_point, atol=1e-12)
        np.testing.assert_allclose(ends[:, 1], X_WP.multiply(cable.anchor_point), atol=1e-12)


def test_system_draws_while_a_simulation_runs(robot):
    meshcat = Meshcat()
    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", CableRobot(robot))
    drawing = builder.AddNamedSystem(
        "pictures", MeshcatCables(CablePictures(meshcat, robot, 5.0), 8)
    )
    for name in ("X_WP", "tensions"):
        builder.Connect(block.GetOutputPort(name), drawing.GetInputPort(name))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "cable_velocities")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("cable_velocities").FixValue(context, np.zeros(8))
    block.hang(block.GetMyMutableContextFromRoot(context), robot.home.transform())
    Simulator(diagram, context).AdvanceTo(0.02)
    assert meshcat.HasPath("cables/C1/rod/0")
