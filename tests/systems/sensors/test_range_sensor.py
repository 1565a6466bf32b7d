"""A laser scanner in a scene against distances worked out by hand."""

import numpy as np
import pytest
from pydrake.geometry import Box, Cylinder, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.errors import SensorError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.sensor_catalogue import RangeSensorModel, load_range_sensor
from cdpr_drake.sections.perception.range_sensor import RangeSensor
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from tests.systems.sensors.scenes import scene_of

EXACT = 1e-9
"""Metres; the issue asks for 1e-6."""

WALLS = [
    (Box(0.2, 8.0, 2.0), RigidTransform([3.1, 0.0, 0.0])),
    (Cylinder(0.5, 2.0), RigidTransform([0.0, 2.0, 0.0])),
    (Sphere(0.25), RigidTransform([0.0, -1.0, 0.0])),
]


def model(**changes):
    settings = {
        "name": "test", "title": "", "source": "", "noise": 0.0, "rate_hz": 10.0, "beams": 181,
        "first_angle_deg": -90.0, "last_angle_deg": 90.0, "limits": np.array([0.8, 4.0]),
    }  # fmt: skip
    return RangeSensorModel(**(settings | changes))


def scans(kind, count=1, shapes=WALLS, **options):
    """Scans of times 0, T, ..., with the simulator that a run has, shape (count, k)."""
    builder = DiagramBuilder()
    scene_graph, _ = scene_of(shapes, roles=("perception",))
    builder.AddSystem(scene_graph)
    options.setdefault("X_HS", RigidTransform())
    sensor = RangeSensor(kind, scene_graph.world_frame_id(), sees_parent=True, **options)
    builder.AddSystem(sensor)
    builder.Connect(scene_graph.get_query_output_port(), sensor.GetInputPort("query_object"))
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    own = sensor.GetMyContextFromRoot(simulator.get_context())
    found = []
    for number in range(count):
        simulator.AdvanceTo((number + 0.5) / kind.rate_hz)
        found.append(sensor.GetOutputPort("ranges").Eval(own))
    return np.array(found), sensor


def expected(angles, low, high):
    """Along each beam: the wall x = 3, the cylinder of radius 0.5 at y = 2, the ball at y = -1."""
    d = np.column_stack([np.cos(angles), np.sin(angles)])
    found = np.full(len(angles), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        wall = 3.0 / d[:, 0]
        found = np.where((d[:, 0] > 0) & (np.abs(wall * d[:, 1]) <= 4.0), wall, found)
        for y, r in ((2.0, 0.5), (-1.0, 0.25)):
            b = d[:, 1] * y
            root = np.sqrt(r**2 - (y**2 - b**2))
            found = np.fmin(found, np.where(b > 0.0, b - root, np.nan))
    return np.where(found > high, np.inf, np.where(found < low, -np.inf, found))


def test_a_scan_is_what_geometry_says():
    (found,), sensor = scans(model())
    np.testing.assert_allclose(found, expected(sensor.angles, 0.8, 4.0), atol=EXACT)
    assert np.any(found == np.inf)
    assert np.any(found == -np.inf)
    assert np.sum(np.isfinite(found)) > 50


def test_a_pose_of_the_sensor_moves_the_fan():
    """Turned by 90 degrees about x of the world, it sees floor and ceiling of a tunnel."""
    shapes = [(Box(40.0, 4.0, 0.2), RigidTransform([0, 0, z])) for z in (-1.1, 2.1)]
    X_HS = RigidTransform(RollPitchYaw(np.pi / 2, 0.0, 0.0), np.array([0.5, 0.3, 0.0]))
    (found,), sensor = scans(model(limits=np.array([0.0, 10.0])), X_HS=X_HS, shapes=shapes)
    up = np.sin(sensor.angles)
    with np.errstate(divide="ignore"):
        exact = np.where(up > 0.0, 2.0, 1.0) / np.abs(up)
    np.testing.assert_allclose(found, np.where(exact > 10.0, np.inf, exact), atol=EXACT)


def test_one_beam():
    kind = load_range_sensor("beam")
    found, _ = scans(kind, X_HS=RigidTransform(RollPitchYaw(0, 0, np.pi / 2), np.zeros(3)))
    assert found[0, 0] == pytest.approx(1.5, abs=EXACT)


def test_noise_is_that_of_the_type_and_of_the_seed():
    kind = model(noise=0.01, noise_share=0.02, limits=np.array([0.0, 50.0]))
    found, sensor = scans(kind, 60, name="front", seed=3)
    same, _ = scans(kind, 60, name="front", seed=3)
    np.testing.assert_array_equal(found, same)
    for other in ({"name": "rear", "seed": 3}, {"name": "front", "seed": 4}):
        assert not np.array_equal(found, scans(kind, 1, **other)[0])
    exact = expected(sensor.angles, 0.0, 50.0)
    there = np.isfinite(exact)
    off = (found[:, there] - exact[there]) / (0.01 + 0.02 * exact[there])
    assert np.std(off) == pytest.approx(1.0, rel=5.0 / np.sqrt(2.0 * off.size))
    assert abs(np.mean(off)) < 5.0 / np.sqrt(off.size)
    assert np.all(found[:, ~there] == np.inf)


def test_the_body_that_carries_it_is_not_seen():
    """A head on a robot's platform, from inside of its own box."""
    robot = load_robot("acrobot_small")
    block = CompiledCableRobot(robot)
    context = block.CreateDefaultContext()
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    frame = block.plant.GetBodyFrameIdOrThrow(block.in_plant.body_index)
    kind = model(limits=np.array([0.0, 30.0]), beams=4, first_angle_deg=0.0, last_angle_deg=270.0)
    for sees_parent in (False, True):
        sensor = RangeSensor(
            kind, frame, RigidTransform(robot.box_center()), sees_parent=sees_parent
        )
        own = sensor.CreateDefaultContext()
        query = block.GetOutputPort("query_object").Eval(context)
        sensor.GetInputPort("query_object").FixValue(own, query)
        found = sensor.truth(own)
        half = 0.5 * robot.platform.size[:2]
        inside = np.allclose(found, [half[0], half[1], half[0], half[1]], atol=EXACT)
        assert inside == sees_parent


def test_a_rate_that_is_none_is_refused():
    with pytest.raises(SensorError, match="rate"):
        scans(model(rate_hz=1.0), rate=0.0)
