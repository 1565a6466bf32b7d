"""Discrete plants: up to which time step a platform stays at rest on its cables."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.robot_copies import moved_robot
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.numerics.explicit_integration import largest_discrete_step
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.plant_step import NEAR
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import (
    CableRobotSettings,
    CableSettings,
    DampingSettings,
    WinchSettings,
)
from tests.mechanisms.machines import MACHINES, STIFFNESS

KICK = 1e-6
"""Velocities that disturb a platform [m/s, rad/s]: cables stay taut."""

RESTS = 3e-6
"""Furthest that a kick moves a platform whose step is stable, in units of kick times second."""

ROBOTS = {
    "stiff": ("acrobot_small", CableRobotSettings(cables=CableSettings(stiffness_ratio=9.0))),
    "elastic": ("acrobot_large", CableRobotSettings(cables=CableSettings(model="elastic"))),
    "catenary": ("caroca", CableRobotSettings(cables=CableSettings(model="catenary"))),
    "planar": ("planar", CableRobotSettings()),
    "damped": (
        "acrobot_small",
        CableRobotSettings(damping=DampingSettings(translation=400.0, rotation=2.0)),
    ),
    "motors": ("acrobot_large", CableRobotSettings(winches=WinchSettings(kind="motor"))),
}


def with_robots(step, *robots, settings=None, grown=None):
    """A diagram with robots in one plant, and what `add_cable_robot` returned for each."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(step))
    parts = [add_robot(plant, robot, f"robot_{k}") for k, robot in enumerate(robots)]
    if grown is not None:
        grown(plant, parts[0])
    plant.Finalize()
    blocks = []
    for k, part in enumerate(parts):
        blocks.append(add_cable_robot(builder, part, settings, name=f"robot_{k}"))
        for name, port in blocks[-1].inputs.items():
            if name != "applied_wrench":
                still = builder.AddSystem(ConstantVectorSource(np.zeros(port.size())))
                builder.Connect(still.get_output_port(), port)
    return builder.Build(), blocks


def largest_step(build):
    """The step that a refusal names [s]."""
    with pytest.raises(CableModelError, match=r"time_step of the plant of .*: found 10 s") as found:
        build(10.0)
    return float(str(found.value).split("up to ")[1].split(" s")[0])


def moved_by(diagram, blocks, duration):
    """How far a kick moves the first platform [m, rad]."""
    context = diagram.CreateDefaultContext()
    for block in blocks:
        block.set_at_equilibrium(context, block.robot.home.transform())
    plant = blocks[0].plant
    own = plant.GetMyMutableContextFromRoot(context)
    start = plant.GetPositions(own).copy()
    plant.SetVelocities(own, KICK * np.cos(np.arange(plant.num_velocities())))
    Simulator(diagram, context).AdvanceTo(duration)
    return np.max(np.abs(plant.GetPositions(own) - start))


def test_of_one_mass_the_step_is_that_of_a_formula():
    for m, k, T in ((2.0, 3e4, 1e-3), (0.1, 50.0, 0.0), (7.0, 1e6, 2e-2)):
        found = largest_discrete_step(np.diag([m, m]), np.diag([k, 0.0]), np.diag([T * k, 0.0]))
        assert found == pytest.approx(-T + np.sqrt(T**2 + 4.0 * m / k), rel=1e-9)
    assert largest_discrete_step(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2))) == np.inf


@pytest.mark.parametrize("kind", ROBOTS)
def test_the_largest_step_is_where_a_platform_begins_to_leave_its_rest(kind, monkeypatch, caplog):
    name, settings = ROBOTS[kind]
    robot = load_robot(name)
    step = largest_step(lambda h: with_robots(h, robot, settings=settings))
    rests = moved_by(*with_robots(0.98 * step, robot, settings=settings), 300 * step)
    assert f"of {robot.name}: found {0.98 * step:g} s; the vibrations" in caplog.text
    assert rests < RESTS * max(1.0, 300 * step)
    monkeypatch.setattr("cdpr_drake.systems.robots.plant_step.check_plant_step", lambda *_: None)
    leaves = moved_by(*with_robots(1.03 * step, robot, settings=settings), 300 * step)
    assert leaves > 30.0 * rests


def test_no_word_of_a_short_step_and_rest_to_rounding(caplog):
    diagram, blocks = with_robots(5e-4, load_robot("acrobot_small"))
    context = diagram.CreateDefaultContext()
    blocks[0].set_at_equilibrium(context, blocks[0].robot.home.transform())
    own = blocks[0].plant.GetMyContextFromRoot(context)
    start = blocks[0].plant.GetPositions(own).copy()
    Simulator(diagram, context).AdvanceTo(0.5)
    assert np.max(np.abs(blocks[0].plant.GetPositions(own) - start)) < 1e-12
    assert not caplog.text


def test_of_two_robots_the_stiffer_one_counts():
    small = load_robot("acrobot_small")
    alone = largest_step(lambda h: with_robots(h, small))
    large = moved_robot(load_robot("caroca"), [20.0, 0.0, 0.0])
    with pytest.raises(CableModelError, match=f"of acrobot_small: .* up to {alone:g} s"):
        with_robots(1.2 * alone, large, small)


def test_a_load_on_the_platform_lets_the_step_be_longer():
    def grown(plant, in_plant):
        ball = plant.AddRigidBody(
            "load", in_plant.model_instance, SpatialInertia.SolidSphereWithMass(20.0, 0.2)
        )
        plant.WeldFrames(in_plant.body.body_frame(), ball.body_frame())

    robot = load_robot("acrobot_small")
    alone = largest_step(lambda h: with_robots(h, robot))
    assert largest_step(lambda h: with_robots(h, robot, grown=grown)) > 1.5 * alone


def test_where_cables_are_shorter_the_step_is_asked_for_again():
    robot = load_robot("acrobot_small")
    step = largest_step(lambda h: with_robots(h, robot))
    diagram, (block,) = with_robots(0.999 * step, robot)
    context = diagram.CreateDefaultContext()
    X_WP = robot.home.transform()
    X_WP.set_translation([0.25, 0.2, 0.3])
    with pytest.raises(CableModelError, match="time_step of the plant of acrobot_small"):
        block.set_at_equilibrium(context, X_WP)


@pytest.mark.parametrize("method", ["joints", "bodies"])
def test_cables_of_a_mechanism_are_asked_too_also_one_by_one(method, caplog):
    def build(step, parts=1):
        builder = DiagramBuilder()
        plant = builder.AddSystem(MultibodyPlant(step))
        points = MACHINES["hanging_arm"](plant)
        plant.Finalize()
        for some in np.array_split(list(points), parts):
            routes = [CableRoute(points=points[k], stiffness=STIFFNESS, name=k) for k in some]
            few = CableRoutes.of(plant, routes)
            add_cables(builder, plant, few, method=method, name=f"with_{some[0]}")

    step = largest_step(build)
    build((1.0 + NEAR) / 2.0 * step)
    assert "time_step of the plant of C1" in caplog.text
    with pytest.raises(CableModelError, match="up to"):
        build(1.01 * step, parts=3)
