"""Estimates the platform's pose from the lengths of the tautest cables."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ForwardKinematicsError
from cdpr_drake.geometry import FREE, MotionType
from cdpr_drake.kinematics import ForwardKinematics, tautest_cables
from cdpr_drake.systems.estimators.encoder_lengths import EncoderLengths
from cdpr_drake.systems.estimators.pose_estimator import KnownTag, PoseEstimator, Read


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
