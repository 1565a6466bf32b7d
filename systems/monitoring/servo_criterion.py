"""The stability criterion of a servo at moments of its run, with slack cables left out."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.servoing.visual_features import VisualFeatures
from cdpr_drake.stability.criterion import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.systems.controllers.schemes import ideal_sighting
from cdpr_drake.vision.target import Target


@dataclass(frozen=True, kw_only=True, eq=False)
class ServoCriterion:
    """The criterion of a servo: what is true of it, and what it believes.

    Truth and belief see the same object, as in the thesis: between them stand the platform's pose,
    the points of the cables, and the camera on the platform.

    Attributes:
        cables: The true cables.
        believed: The robot that the controller believes in; with pulleys where it reckons them.
        camera: True pose of the camera on the platform, X_PC [m].
        features: The features that are controlled.
        target: What the camera sees.
        sees: True pose of the object in the camera, from that of the platform and the time [s].
        judges_law: Whether the law is that of the criterion, all features at once.
    """

    cables: CableSet
    believed: BelievedRobot
    camera: RigidTransform
    features: VisualFeatures
    target: Target
    sees: Callable[[RigidTransform, float], RigidTransform]
    judges_law: bool = True

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the platform."""
        return 3 if self.believed.is_planar() else 6

    def at(
        self, X_WP: RigidTransform, X_estimated: RigidTransform, taut: np.ndarray, time: float
    ) -> tuple[int, float]:
        """Rank of the Jacobian and margin of Pi, with the taut cables only.

        Args:
            X_WP: True pose of the platform.
            X_estimated: Its estimate.
            taut: Which cables pull, shape (m,) bool.
            time: Time, for a target that moves [s].

        Returns:
            The rank, and the smallest eigenvalue of the symmetric part of Pi; 0 if the rank is less
            than the platform's degrees of freedom, NaN where the features leave a motion free or
            the criterion does not know the law.

        Raises:
            CableGeometryError: A cable cannot run.

        Source: servoing thesis 5.3.1, (3.1), (3.8).
        """
        planar, freedom = self.believed.is_planar(), self.freedom
        J = cable_jacobian(X_WP, self.cables)[taut]
        if planar:
            J = J[:, list(PLANAR_ROWS)]
        rank = int(np.linalg.matrix_rank(J)) if len(J) else 0
        if self.features.rank < freedom or not self.judges_law:
            return rank, float("nan")
        if rank < freedom:
            return rank, 0.0
        _, L = self.features.evaluate(ideal_sighting(self.target, self.sees(X_WP, time)))
        Pi = stability_matrix(
            ModelAtPose(X_WP, self.cables, self.camera, np.array(L)),
            ModelAtPose(X_estimated, self.believed.cables, self.believed.X_PC, np.array(L)),
            local=len(L) > freedom,
            taut=taut,
            planar=planar,
        )
        return rank, stability_margin(Pi)
