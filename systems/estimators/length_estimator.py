"""Estimators of the platform's pose from the lengths of the tautest cables.

`EncoderLengths` are these lengths as an estimator knows them: counted by the winches from a pose
believed once. `LengthEstimator` finds the pose.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.elastic_law import stretched_lengths, unstrained_lengths
from cdpr_drake.errors import ForwardKinematicsError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import FREE, MotionType
from cdpr_drake.statics.forward_kinematics import ForwardKinematics, tautest_cables
from cdpr_drake.systems.estimators.pose_estimator import KnownTag, PoseEstimator, Read


@dataclass(frozen=True)
class EncoderLengths:
    """Turns encoder readings into lengths that a pose has.

    Encoders tell how much cable was paid out, not how much there was: that follows from the pose
    believed when the counting began. They count cable as it lies on the drum, without stretch.

    Attributes:
        cables: The cables as they are believed to be, with or without pulleys.
        elastic: Whether to stretch the lengths by the measured tensions.

    Source: servoing thesis 2.2.3, (2.6)-(2.8), there linearised.
    """

    cables: CableSet
    elastic: bool

    def reference(self, X_WP: RigidTransform, counted: Array, tensions: Array) -> Array:
        """What to add to counted lengths, shape (m,) [m], from the pose when counting begins.

        Args:
            X_WP: Pose believed then [m].
            counted: Readings of the encoders then, shape (m,) [m].
            tensions: Measured tensions then, shape (m,) [N].
        """
        lengths = cable_paths(X_WP, self.cables).lengths
        if self.elastic:
            lengths = unstrained_lengths(lengths, tensions.clip(min=0.0), self.cables.stiffness)
        return lengths - counted

    def lengths(self, counted: Array, reference: Array, tensions: Array) -> Array:
        """Lengths of the taut cables now, shape (m,) [m]; arguments as for `reference`."""
        lengths = counted + reference
        if self.elastic:
            lengths = stretched_lengths(lengths, tensions, self.cables.stiffness)
        return lengths


class LengthEstimator(PoseEstimator):
    """Estimators 4 to 7: the pose near the last one at which the tautest cables have their lengths.

    ================= ============== ==== ===================================================
    port              type           unit meaning
    ================= ============== ==== ===================================================
    measured_lengths  vector(m)      m    in, lengths that the encoders count
    measured_tensions vector(m)      N    in
    X_WP              RigidTransform m    out, estimated pose of the platform
    ================= ============== ==== ===================================================

    With a known tag also its ports, see `PoseEstimator`. As many cables are used as there are
    degrees of freedom, six or three. Where no pose has their lengths the last estimate stays, as it
    may for a while after a start from a wrong pose, which makes the lengths contradict each other.

    Source: servoing thesis, algorithm 2.
    """

    def __init__(
        self,
        X_WP0: RigidTransform,
        counted: EncoderLengths,
        rate: float,
        motion: MotionType = FREE,
        known_tag: KnownTag | None = None,
    ) -> None:
        """With the pose believed at time 0 [m], the lengths, and control steps per second [Hz].

        Raises:
            ForwardKinematicsError: There are fewer cables than degrees of freedom.
        """
        m = counted.cables.count
        # What to add to the lengths that are counted; NaN before the counting began.
        super().__init__(X_WP0, rate, np.full(m, np.nan), known_tag)
        self._counted = counted
        self._kinematics = ForwardKinematics(counted.cables, motion)
        self.DeclareVectorInputPort("measured_lengths", m)
        self.DeclareVectorInputPort("measured_tensions", m)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """Begins to count, or finds the pose with the lengths of now."""
        if np.isnan(extra[0]):
            return X_WP, self.restart(read, X_WP, extra)
        tensions = read("measured_tensions")
        lengths = self._counted.lengths(read("measured_lengths"), extra, tensions)
        used = tautest_cables(tensions, self._kinematics.num_unknowns)
        with suppress(ForwardKinematicsError):  # no pose has these lengths: the last one stays
            X_WP = self._kinematics.pose(lengths, X_WP, used).X_WP
        return X_WP, extra

    def restart(self, read: Read, X_WP: RigidTransform, extra: Array) -> Array:
        """Counts from the pose that is known now."""
        tensions = read("measured_tensions")
        return self._counted.reference(X_WP, read("measured_lengths"), tensions)
