"""Features of all schemes, targets that they see, and a platform that does what it is told."""

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import exponential, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.combined_features import PartitionedFeatures, SwitchedFeatures
from cdpr_drake.servoing.visual_features import (
    CameraPoseFeatures,
    CircleFeatures,
    DepthRule,
    HybridFeatures,
    ObjectPoseFeatures,
    PointFeatures,
    WithoutFeature,
    sighting,
)
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.rings import CircleTarget

PERIOD = 0.04
SMALL = load_robot("acrobot_small")
DOTS, RING = DotTarget(0.06), CircleTarget(0.06)
PLAIN = DepthRule()


def points(X, depth=PLAIN, chosen=None):
    return PointFeatures(DOTS.points, X, depth, chosen)


MAKERS = {  # features with a desired pose and a rule of depths
    "pbvs": lambda X, depth=PLAIN: ObjectPoseFeatures(X),
    "pbvs-line": lambda X, depth=PLAIN: CameraPoseFeatures(X),
    "2.5d": HybridFeatures,
    "ibvs": points,
    "ibvs, three": lambda X, depth=PLAIN: points(X, depth, (3, 0, 2)),
    "circles": lambda X, depth=PLAIN: CircleFeatures(RING.radii, X, depth),
    "2.5d, five": lambda X, depth=PLAIN: WithoutFeature(HybridFeatures(X, depth)),
    "pbvs, five": lambda X, depth=PLAIN: WithoutFeature(ObjectPoseFeatures(X)),
    "without the first": lambda X, depth=PLAIN: WithoutFeature(ObjectPoseFeatures(X), 0),
    "partitioned": lambda X: PartitionedFeatures(points(X)),
    "partitioned, three": lambda X: PartitionedFeatures(points(X, chosen=(3, 0, 1)), (1, 3)),
    "switching": lambda X: SwitchedFeatures(points(X)),
    "switching, object": lambda X: SwitchedFeatures(points(X), of_camera=False),
}
PACKED = [name for name in MAKERS if not name.startswith(("partitioned", "switching"))]


def target_of(name):
    return RING if name == "circles" else DOTS


def seen(name, X_CO):
    return sighting(X_CO, target_of(name).ideal_marks(X_CO))


def frontal(depth):
    """A desired pose: straight in front of the camera."""
    return pose_from_angles(np.array([0.0, 0.0, depth]), np.radians([180.0, 0.0, 180.0]))


class Run:
    """A platform that moves exactly as it is told, and what was recorded.

    Args:
        servo: A `ServoController`.
        see: What the camera sees from a pose of the platform at a time: (sighting, X_CO).
        X_WP: Where it starts.
        duration: [s]
        push: Step at which it is moved, and by what.
    """

    def __init__(self, servo, see, X_WP, duration, push=(None, None)):
        memory = servo.fresh_memory()
        self.X_COs, self.X_WPs, self.commands, self.memories = [], [], [], []
        for number in range(round(duration / PERIOD)):
            if number == push[0]:
                X_WP = push[1] @ X_WP
            time = number * PERIOD
            sight, X_CO = see(X_WP, time)
            R, p = X_WP.rotation().matrix(), X_WP.translation()
            command, memory = servo.step(memory, sight, R, p, time)
            self.X_COs.append(X_CO)
            self.X_WPs.append(X_WP)
            self.commands.append(command)
            self.memories.append(memory)
            X_WP = X_WP @ exponential(command.V_P * PERIOD)
        self.last = see(X_WP, duration)[1]
        self.memory = memory
        self.errors = np.array([command.error for command in self.commands])


def in_hand(name, X_PC=None, object_at=None):
    """What a camera on the platform sees of an object that may move."""
    X_PC = X_PC or RigidTransform()

    def see(X_WP, time):
        X_CO = (X_WP @ X_PC).inverse() @ object_at(time)
        return seen(name, X_CO), X_CO

    return see
