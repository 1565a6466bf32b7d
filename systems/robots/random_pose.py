"""Random starts: where platforms of random contexts are, with lengths that hold them there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pydrake.symbolic as symbolic
from pydrake.common.eigen_geometry import Quaternion_
from pydrake.math import RigidTransform
from pydrake.multibody.tree import JointIndex, PlanarJoint, PrismaticJoint, QuaternionFloatingJoint
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import Context, LeafSystem, State

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.models.robot_in_plant import RobotInPlant, pose_on_joint

NUMBERS = 6
"""Random numbers of a pose: three of its position, three of its rotation."""

RANDOM_NUMBERS = "random_numbers"
"""Input port of a `CompiledMotion` with a random pose."""


@dataclass(frozen=True, kw_only=True)
class RandomPose:
    """Poses of platforms in random contexts, uniform about the default pose.

    `SetRandomContext`, and so `RandomSimulation` and `MonteCarloSimulation`, draw the pose; a
    simulator that is initialized then sets the lengths that hold the platform there at rest,
    unless somebody has set lengths. A pose that no tensions hold is an error then.

    Attributes:
        position: Largest distance of Po along x, y and z of W, shape (3,) [m].
        angles_deg: Largest turns about x, y and z of P, one after the other, shape (3,) [deg]. Of a
            platform in a plane the third, about the plane's normal, counts alone.
    """

    position: Array = field(default_factory=lambda: np.zeros(3))
    angles_deg: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for name in ("position", "angles_deg"):
            values = np.asarray(getattr(self, name), float)
            if values.shape != (3,) or not np.all(np.isfinite(values)) or np.any(values < 0.0):
                raise CdprError(
                    f"RandomPose.{name}: found {getattr(self, name)}; accepted: three numbers, 0 "
                    "or more"
                )
            object.__setattr__(self, name, values)

    def coordinates(self, joint: PlatformJoint, X_WP: RigidTransform, numbers: Any) -> Any:
        """Coordinates of the platform, as its plant has them.

        Args:
            joint: What it moves by.
            X_WP: The default pose [m].
            numbers: Uniform in 0..1, shape (6,), numbers or Expressions.
        """
        moved = self.position * (2.0 * numbers[:3] - 1.0)
        turned = np.radians(self.angles_deg) * (2.0 * numbers[3:] - 1.0)
        if joint.is_floating:
            q = X_WP.rotation().ToQuaternion().wxyz()
            for axis, angle in enumerate(turned):
                q = _turned(q, axis, 0.5 * angle)
            return np.concatenate([q, X_WP.translation() + moved])
        in_joint, own = joint.X_WF.rotation().matrix().T @ moved, joint.coordinates(X_WP)
        if joint.is_line:
            return own + in_joint[:1]
        return own + np.array([in_joint[0], in_joint[1], turned[2]])

    def pose(self, joint: PlatformJoint, X_WP: RigidTransform, numbers: Array) -> RigidTransform:
        """X_WP of the platform [m]; arguments as of `coordinates`."""
        q = self.coordinates(joint, X_WP, np.asarray(numbers, float))
        pose: RigidTransform = pose_on_joint(joint, np.append(q, np.zeros(joint.num_velocities)))
        return pose

    def put_on(self, in_plant: RobotInPlant, X_WP: RigidTransform) -> None:
        """Gives the joint of a platform in a finalized plant this distribution."""
        uniform = Variable.Type.RANDOM_UNIFORM
        numbers = np.array([Expression(Variable(f"u{k}", uniform)) for k in range(NUMBERS)])
        with np.errstate(invalid="ignore"):  # Expressions set the flag
            q = self.coordinates(in_plant.robot.joint(), X_WP, numbers)
        plant = in_plant.plant
        joints = (plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices())
        (joint,) = (j for j in joints if j.child_body().index() == in_plant.body_index)
        if isinstance(joint, QuaternionFloatingJoint):
            turn = Quaternion_[Expression](*(Expression(0.0) + x for x in q[:4]))
            joint.set_random_quaternion_distribution(turn)
            joint.set_random_translation_distribution(q[4:])
        elif isinstance(joint, PlanarJoint):
            joint.set_random_pose_distribution(q[:2], q[2])
        else:
            assert isinstance(joint, PrismaticJoint)
            joint.set_random_translation_distribution(q[0])


def _turned(q: Any, axis: int, half: Any) -> Any:
    """Quaternion q times a turn about an axis by twice an angle [rad]."""
    is_number = isinstance(half, float)
    c, s = (np.cos(half), np.sin(half)) if is_number else (symbolic.cos(half), symbolic.sin(half))
    w, v = q[0], q[1:]
    e = np.eye(3)[axis]
    cross = np.array([v[1] * e[2] - v[2] * e[1], v[2] * e[0] - v[0] * e[2],
                      v[0] * e[1] - v[1] * e[0]])  # fmt: skip
    return np.concatenate([[w * c - v[axis] * s], w * s * e + c * v + s * cross])


@dataclass(frozen=True)
class Following:
    """How winches take their lengths from the platform's pose, where nobody has set them.

    Attributes:
        num_states: Numbers of the platform's state.
        default: Coordinates of the platform in default contexts.
        state_at: State of the winches that hold the platform, from its state; raises CdprError.
    """

    num_states: int
    default: Array
    state_at: Callable[[Array], Array]

    def declare(self, winches: LeafSystem, begin: Array) -> None:
        """Declares the input platform_state and the event of winches with a continuous state.

        Args:
            winches: The winches.
            begin: Their default state.
        """
        port = winches.DeclareVectorInputPort("platform_state", self.num_states)

        def follow(context: Context, state: State) -> None:
            now = port.Eval(context)
            moved = not np.array_equal(now[: len(self.default)], self.default)
            own = context.get_continuous_state_vector().CopyToVector()
            if moved and np.array_equal(own, begin):
                vector = state.get_mutable_continuous_state().get_mutable_vector()
                vector.SetFromVector(self.state_at(now))

        winches.DeclareInitializationUnrestrictedUpdateEvent(follow)
