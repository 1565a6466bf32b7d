"""An independent engine: the same elastic robot in MuJoCo, its cables as spatial tendons.

A tendon with springlength (0, l0) and stiffness E S / l0 is a straight spring that only pulls. It
has no Kelvin-Voigt damping that ends where the tendon goes slack, so all cables are undamped here.

At the real stiffness of 350 kN, ACROBOT's cables stretch by 7 um at rest: let go from millimetres
away, the undamped platform bounces between impacts of half a millisecond, which is chaotic (half
the step gives another path, in either engine). So centimetres of motion, with cables that go slack
and catch, are compared on cables a thousand times softer, and the real ones as long as they stay
taut.
"""

import mujoco
import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import pose_error, rotation_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from tests.systems.robots.engines import place, pose, put, read, settings_of, started

DISTANCE, ANGLE = 1e-4, np.radians(0.01)
"""How far the engines may part [m, rad]. Found: 0.5 um and 8e-4 deg with soft cables, 0.3 um
and 6e-4 deg with real ones; both by errors of the integrators, which fall as their step does."""

DURATION, LOOKS = 0.8, 16
DISPLACEMENT = np.array([0.1, -0.05, 0.15, 0.02, -0.015, 0.02])
"""From the pose of rest to where it is let go: angles about x, y, z [rad], translation [m]."""

POSES = [
    RigidTransform([0.05, -0.08, 0.3]),
    RigidTransform(rotation_from_angles(np.radians([5.0, -4.0, 8.0])), [-0.1, 0.1, 0.4]),
    RigidTransform([0.1, 0.05, 0.2]),
]


def tendon_model(robot, step):
    """The robot as a MuJoCo model: a free box and one tendon a cable."""

    def words(values):
        return " ".join(repr(float(value)) for value in values)

    x, y, z = robot.platform.size
    mass = robot.platform.mass
    inertia = mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    ends = list(enumerate(robot.cables))
    exits = "".join(f'<site name="A{i}" pos="{words(c.exit_point)}"/>' for i, c in ends)
    anchors = "".join(f'<site name="B{i}" pos="{words(c.anchor_point)}"/>' for i, c in ends)
    tendons = "".join(
        '<spatial stiffness="1" springlength="0 1">'
        f'<site site="A{i}"/><site site="B{i}"/></spatial>'
        for i, _ in ends
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" integrator="RK4" gravity="0 0 {-robot.gravity}"/>'
        f"<worldbody>{exits}<body><freejoint/>"
        f'<inertial pos="{words(robot.center_of_mass())}" mass="{mass}" '
        f'diaginertia="{words(inertia)}"/>{anchors}</body></worldbody>'
        f"<tendon>{tendons}</tendon></mujoco>"
    )


RUNS = {
    "free": (1e3, 0, 1.0, 0.0),
    "free, turned": (1e3, 1, 1.0, 0.0),
    "free, low": (1e3, 2, 1.0, 0.0),
    "wound up by 2 cm/s": (1e3, 0, 1.0, -0.02),
    "real stiffness": (1.0, 1, 1e-4, 0.0),
}
"""How much softer cables are, the pose of rest, the share of the displacement, the speed [m/s]."""


@pytest.mark.parametrize("run", RUNS)
def test_both_engines_swing_alike(run):
    """By centimetres, with cables that go slack and catch; by micrometres on taut real ones."""
    softer, index, share, ramp = RUNS[run]
    real, step = softer == 1.0, 1e-4 if softer == 1.0 else 2e-4
    duration = 0.2 if real else DURATION
    robot, X_WP, displacement = load_robot("acrobot_small"), POSES[index], share * DISPLACEMENT
    robot.cable.youngs_modulus /= softer
    block, simulator, context = started(
        CableRobot, robot, settings_of(model="elastic"), step, X_WP=X_WP
    )
    start = RigidTransform(
        rotation_from_angles(displacement[:3]) @ X_WP.rotation(),
        X_WP.translation() + displacement[3:],
    )
    put(block, context, start)
    block.GetInputPort("cable_velocities").FixValue(context, np.full(8, ramp))
    first = read(block, context, "unstrained_lengths")
    model = tendon_model(robot, step)
    data = mujoco.MjData(model)
    data.qpos[:3] = start.translation()
    data.qpos[3:] = start.rotation().ToQuaternion().wxyz()
    stiffness, steps = robot.stiffness(), round(duration / LOOKS / step)
    travel, slack = 0.0, 0
    for look in range(1, LOOKS + 1):
        simulator.AdvanceTo(look * duration / LOOKS)
        for k in range((look - 1) * steps, look * steps):
            l0 = first + ramp * (k + 0.5) * step  # of the middle of the step: second order
            model.tendon_lengthspring[:, 1] = l0
            model.tendon_stiffness.reshape(len(l0), -1)[:, 0] = stiffness / l0
            mujoco.mj_step(model, data)
        q = data.qpos[3:] / np.linalg.norm(data.qpos[3:])
        tendons = RigidTransform(Quaternion(q), data.qpos[:3])
        distance, angle = pose_error(pose(block, context), tendons)
        assert distance < (0.01 if real else 1.0) * DISTANCE
        assert angle < (0.1 if real else 1.0) * ANGLE
        travel = max(travel, np.linalg.norm(place(block, context) - start.translation()))
        slack = max(slack, np.sum(read(block, context, "slack")))
    assert travel > (1e-6 if real else 0.02)  # not by standing still
    assert slack == 0 if real else slack >= 4
