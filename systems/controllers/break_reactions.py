"""What a platform does when a cable has broken, see section `emergency` and `break_survival`.

* stop: the brakes of all winches close;
* redistribute: the controller of motor torques asks the cables that are left for the wrench, at
  once, and the winch of the broken one stands still. The platform is to stay where it is, or to go
  on where the servo wants it;
* brake: the same, but only motion is to end, with least kinetic energy, wherever that is;
* retreat: the same, and the platform goes to the nearest pose that the cables left hold;
* descend: the same, and it goes straight down until its lowest anchor point is near the ground.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_vector
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics.nearest_held_pose import Load, nearest_held_pose

STOP, REDISTRIBUTE, BRAKE, RETREAT, DESCEND = REACTIONS = (
    "stop", "redistribute", "brake", "retreat", "descend",
)  # fmt: skip
HOLD, CONTINUE = "hold", "continue"


@dataclass(frozen=True)
class ReactionRule:
    """What is done when a cable has broken.

    Attributes:
        reaction: One of `REACTIONS`.
        motion: What redistribution is to do with the platform: hold it where it is, or continue.
        speed: Largest speed of a retreat, of which turning counts with the anchor points' distance,
            and that of a descent [m/s].
        least_tension: Smallest tension of the cables left at the pose of a retreat [N].
        ground_distance: Height of the lowest anchor point over the frame's lower end at which a
            descent ends [m].
        delay: From when the break is known until the brakes have closed, or the others are asked
            [s].
        rate: How often it is looked at [Hz].
    """

    reaction: str
    motion: str = HOLD
    speed: float = 0.1
    least_tension: float = 0.5
    ground_distance: float = 0.02
    delay: float = 0.0
    rate: float = 500.0


APPROACH = 2.0
"""Rate at which a retreat's distance fades where its speed does not bound it [1/s]."""


@dataclass(frozen=True)
class WaysOut:
    """What a reaction that moves the platform knows of it.

    Attributes:
        held: Gives the nearest pose that the cables left hold, from the believed one and flags of
            those that are broken, shape (m,).
        anchors: Anchor points in P, shape (3, m) [m].
        ground: Height where the ground is [m].
    """

    held: Callable[[RigidTransform, Array], RigidTransform]
    anchors: Array
    ground: float

    @property
    def size(self) -> float:
        """Root mean square of the anchor points' distances from Po [m]."""
        return float(np.sqrt(np.mean(np.sum(self.anchors**2, axis=0))))


def retreat_twist(X_WP: RigidTransform, goal: RigidTransform, speed: float, size: float) -> Array:
    """Twist (w, v) of P in P toward a pose, shape (6,) [rad/s, m/s].

    Args:
        X_WP: Where it is.
        goal: Where it is to go.
        speed: The largest, of |v| and `size` |w| together [m/s].
        size: Length that makes turns comparable [m].
    """
    off = X_WP.inverse() @ goal
    twist = APPROACH * np.concatenate([rotation_vector(off.rotation()), off.translation()])
    fast = float(np.hypot(size * np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])))
    return np.asarray(twist * min(1.0, speed / fast) if fast > 0.0 else twist)


def descent_twist(X_WP: RigidTransform, anchors: Array, ground: float, rule: ReactionRule) -> Array:
    """Twist (w, v) of P in P straight down, zero near the ground, shape (6,) [rad/s, m/s].

    Args:
        X_WP: Where it is.
        anchors: Anchor points in P, shape (3, m) [m].
        ground: Height of the ground [m].
        rule: Speed, and where it ends.
    """
    over = float(np.min((X_WP @ anchors)[2])) - ground - rule.ground_distance
    down = -min(rule.speed, max(APPROACH * over, 0.0))
    v = X_WP.rotation().matrix().T @ np.array([0.0, 0.0, down])
    return np.concatenate([np.zeros(3), v])


def ways_out(rule: ReactionRule, robot: Robot, believed: CableSet, most: float) -> WaysOut:
    """What a reaction that moves the platform knows of a robot.

    Args:
        rule: The reaction.
        robot: The robot.
        believed: Its cables as believed.
        most: Largest tension that is asked for [N].
    """
    cables = believed.without_pulleys()
    load = Load(robot.platform.mass, robot.center_of_mass(), robot.gravity_vector())
    anchors = cables.p_PB
    size = float(np.sqrt(np.mean(np.sum(anchors**2, axis=0))))
    home = robot.home.transform()

    def held(X_WP: RigidTransform, broken: Array) -> RigidTransform:
        left = broken == 0.0
        bounds = np.array([rule.least_tension * left, most * left])
        found = nearest_held_pose(X_WP, cables, load, bounds, size=size, starts=[home])
        return X_WP if found is None else found.X_WP

    return WaysOut(held, anchors, float(robot.frame.lower[2]))
