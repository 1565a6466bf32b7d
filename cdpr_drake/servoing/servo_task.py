"""What a visual servo is asked to do, how its camera is mounted, and which robot it believes in.

`ServoTask`: features, where they should be, and on which path. `CameraMounting`: where camera and
object are fixed, on the platform or in the world. `BelievedRobot`: what controllers and estimators
believe about the robot that they move.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS
from cdpr_drake.servoing.feature_plan import FeaturePlan
from cdpr_drake.servoing.visual_features import Sighting, VisualFeatures

INTERACTIONS = ("current", "desired", "mean")


@dataclass(frozen=True)
class ServoTask:
    """One task of a visual servo.

    Attributes:
        features: The features.
        final: s* at the end, shape (k,).
        L_desired: Interaction matrix there, shape (k, 6).
        interaction: Which interaction matrix the control uses: one of `INTERACTIONS`.
        plan: The path there; None: s* is `final` from the start.
        begins: Time at which this task takes over [s].
        resting: s*(t), ds*/dt and the drift b without plan and motion of the object, shape (3, k).
    """

    features: VisualFeatures
    final: Array
    L_desired: Array
    interaction: str = "current"
    plan: FeaturePlan | None = None
    begins: float = 0.0
    resting: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """What is asked for at rest follows from the rest."""
        k = len(self.final)
        object.__setattr__(self, "resting", np.vstack([self.final, np.zeros((2, k))]))

    def chosen_interaction(self, L: Array) -> Array:
        """The matrix that the control uses, from the current one, shape (k, 6)."""
        if self.interaction == "current":
            return L
        if self.interaction == "desired":
            return self.L_desired
        return 0.5 * (L + self.L_desired)


def make_task(
    features: VisualFeatures,
    desired: Sighting,
    interaction: str = "current",
    plan: FeaturePlan | None = None,
    begins: float = 0.0,
) -> ServoTask:
    """The task of seeing what is seen at the desired pose; see `ServoTask`."""
    final, L = features.evaluate(desired)
    return ServoTask(features, np.array(final), np.array(L), interaction, plan, begins)


@dataclass(frozen=True)
class CameraMounting:
    """How a camera sees an object.

    Attributes:
        X_BC: Pose of the camera C on its carrier B: the platform P (eye in hand), or the world W
            (eye to hand) [m].
        X_PO: Pose of the object O on the platform, for eye to hand; None: eye in hand [m].
        turns: Whether joints turn the camera about X_BC, where both of their angles are zero.
    """

    X_BC: RigidTransform
    X_PO: RigidTransform | None = None
    turns: bool = False

    def is_eye_to_hand(self) -> bool:
        """Whether the camera stands in the world and the object moves with the platform."""
        return self.X_PO is not None

    def X_WC(self, X_WP: RigidTransform) -> RigidTransform:
        """Pose of the camera in W."""
        return self.X_BC if self.X_PO is not None else X_WP @ self.X_BC

    def X_CO(self, X_WP: RigidTransform, X_WO: RigidTransform | None = None) -> RigidTransform:
        """Pose of the object in the camera; X_WO is that of an object that is not on P."""
        if self.X_PO is not None:
            X_WO = X_WP @ self.X_PO
        assert X_WO is not None
        return self.X_WC(X_WP).inverse() @ X_WO

    def X_WP(self, X_CO: RigidTransform, X_WO: RigidTransform | None = None) -> RigidTransform:
        """Pose of the platform from which the object is seen at X_CO."""
        if self.X_PO is not None:
            return self.X_BC @ X_CO @ self.X_PO.inverse()
        assert X_WO is not None
        return X_WO @ (self.X_BC @ X_CO).inverse()

    def from_platform(self, seen: Sighting) -> RigidTransform:
        """X_PC now."""
        if self.X_PO is None:
            return self.X_BC
        return self.X_PO @ RigidTransform(RotationMatrix(seen.R_CO), seen.p_CO).inverse()


@dataclass(frozen=True)
class BelievedRobot:
    """What controller and estimators believe about the robot; the simulated robot may differ.

    Attributes:
        cables: All constants of the cables.
        X_PC: Camera C on the platform [m].
        X_WP0: Pose of the platform at the start [m].
        motions: Components of the platform's twist in P, ordered (rotation, translation), that
            the robot can move: all six, or (2, 3, 4) for 2T1R.
        cable_speed: Largest cable speed to ask for [m/s].
    """

    cables: CableSet
    X_PC: RigidTransform
    X_WP0: RigidTransform
    motions: tuple[int, ...] = ALL_ROWS
    cable_speed: float = math.inf

    def is_planar(self) -> bool:
        """Whether the platform slides in a plane, 2T1R."""
        return self.motions == PLANAR_ROWS
