"""Estimators of the platform's pose from images."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.pose_from_images import (
    object_from_pose,
    pose_from_images,
    pose_from_object,
)
from cdpr_drake.systems.estimators.pose_estimator import (
    KnownTag,
    PoseEstimator,
    Read,
    pack_pose,
    unpack_pose,
)

_NOTHING_SEEN = np.zeros(13)
"""Memory of an estimator that has seen nothing; else 1 and a pose."""


class _ImageEstimator(PoseEstimator):
    """What estimators from images of one object share: constructor, ports, the object unseen."""

    def __init__(
        self,
        X_WP0: RigidTransform,
        X_PC: RigidTransform,
        rate: float,
        known_tag: KnownTag | None = None,
    ) -> None:
        """With the pose at time 0 and the camera on the platform [m]; control steps [Hz]."""
        super().__init__(X_WP0, rate, _NOTHING_SEEN, known_tag)
        self._X_PC = X_PC
        self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
        self.DeclareVectorInputPort("found", 1)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """Takes the image of now; without the object in it, all stays as it was."""
        if read("found")[0] == 0.0:
            return X_WP, extra
        X_CO = read("X_CO")
        if extra[0] == 0.0:
            return X_WP, self._remember(X_WP, X_CO)
        return self._seen(X_WP, unpack_pose(extra[1:]), X_CO, extra)

    def restart(self, read: Read, X_WP: RigidTransform, extra: Array) -> Array:
        """The image of now belongs to the pose that is known; an older one does not."""
        if read("found")[0] == 0.0:
            return _NOTHING_SEEN
        return self._remember(X_WP, read("X_CO"))

    @abstractmethod
    def _remember(self, X_WP: RigidTransform, X_CO: RigidTransform) -> Array:
        """Memory of an image that was taken at X_WP."""

    @abstractmethod
    def _seen(
        self, X_WP: RigidTransform, remembered: RigidTransform, X_CO: RigidTransform, extra: Array
    ) -> tuple[RigidTransform, Array]:
        """Estimate and memory with an image of now, from the last ones."""


class ConsecutiveImages(_ImageEstimator):
    """Estimator 2: what the object at rest did between two images, the camera did in reverse.

    ===== ============== ==== ==============================================
    port  type           unit meaning
    ===== ============== ==== ==============================================
    X_CO  RigidTransform m    in, measured pose of the object in the camera
    found vector(1)      -    in, 1 while it is seen
    X_WP  RigidTransform m    out, estimated pose of the platform
    ===== ============== ==== ==============================================

    With a known tag also its ports, see `PoseEstimator`. While the object is not seen the estimate
    stays; then the last image that showed it is compared with the first new one. So long as it
    does not begin anew it gives what `FirstImage` gives, see `pose_from_images`.

    Source: servoing thesis (2.4).
    """

    def _remember(self, X_WP: RigidTransform, X_CO: RigidTransform) -> Array:
        """What the image shows."""
        return np.concatenate([[1.0], pack_pose(X_CO)])

    def _seen(
        self, X_WP: RigidTransform, remembered: RigidTransform, X_CO: RigidTransform, extra: Array
    ) -> tuple[RigidTransform, Array]:
        """Compares the image of now with the last one."""
        X_WP = pose_from_images(X_WP, self._X_PC, remembered, X_CO)
        return X_WP, self._remember(X_WP, X_CO)


class FirstImage(_ImageEstimator):
    """Estimator 3: the first image tells where the object at rest is, each further one the pose.

    ===== ============== ==== ==============================================
    port  type           unit meaning
    ===== ============== ==== ==============================================
    X_CO  RigidTransform m    in, measured pose of the object in the camera
    found vector(1)      -    in, 1 while it is seen
    X_WP  RigidTransform m    out, estimated pose of the platform
    ===== ============== ==== ==============================================

    With a known tag also its ports, see `PoseEstimator`. While the object is not seen the estimate
    stays.

    Source: servoing thesis (2.5).
    """

    def _remember(self, X_WP: RigidTransform, X_CO: RigidTransform) -> Array:
        """Where the object is, by this image."""
        return np.concatenate([[1.0], pack_pose(object_from_pose(X_WP, self._X_PC, X_CO))])

    def _seen(
        self, X_WP: RigidTransform, remembered: RigidTransform, X_CO: RigidTransform, extra: Array
    ) -> tuple[RigidTransform, Array]:
        """The pose from which the object, where the first image put it, looks as it does now."""
        return pose_from_object(remembered, self._X_PC, X_CO), extra


class KnownObject(PoseEstimator):
    """The pose from an object whose pose in W is known; while it is not seen, the last one.

    =============== ============== ==== ====================================================
    port            type           unit meaning
    =============== ============== ==== ====================================================
    X_CK            RigidTransform m    in, measured pose of the known object in the camera
    known_tag_found vector(1)      -    in, 1 while it is seen
    X_WP            RigidTransform m    out, estimated pose of the platform
    =============== ============== ==== ====================================================

    Source: servoing thesis 2.2.2.
    """

    def __init__(
        self, X_WP0: RigidTransform, X_PC: RigidTransform, X_WK: RigidTransform, rate: float
    ) -> None:
        """With the pose at time 0, the camera on the platform and the object [m]; steps [Hz]."""
        super().__init__(X_WP0, rate, np.zeros(0))
        self._X_PC, self._X_WK = X_PC, X_WK
        self.DeclareAbstractInputPort("X_CK", Value(RigidTransform()))
        self.DeclareVectorInputPort("known_tag_found", 1)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """The pose that the image of now gives."""
        if read("known_tag_found")[0] != 0.0:
            X_WP = pose_from_object(self._X_WK, self._X_PC, read("X_CK"))
        return X_WP, extra


class PlatformTagEstimator(PoseEstimator):
    """The pose from a camera in the world that sees a tag on the platform; else the last one.

    ================== ============== ==== ==================================================
    port               type           unit meaning
    ================== ============== ==== ==================================================
    X_CQ               RigidTransform m    in, measured pose of the tag Q in that camera
    platform_tag_found vector(1)      -    in, 1 while it is seen
    X_WP               RigidTransform m    out, X_WC X_CQ X_PQ^-1
    ================== ============== ==== ==================================================

    Source: servoing thesis 5.2.3, Fig. 5.8.
    """

    def __init__(
        self, X_WP0: RigidTransform, X_WC: RigidTransform, X_PQ: RigidTransform, rate: float
    ) -> None:
        """With the pose at time 0, the camera in W, the tag on the platform [m]; steps [Hz]."""
        super().__init__(X_WP0, rate, np.zeros(0))
        self._X_WC, self._X_QP = X_WC, X_PQ.inverse()
        self.DeclareAbstractInputPort("X_CQ", Value(RigidTransform()))
        self.DeclareVectorInputPort("platform_tag_found", 1)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """The pose that the image of now gives."""
        if read("platform_tag_found")[0] != 0.0:
            X_WP = self._X_WC @ read("X_CQ") @ self._X_QP
        return X_WP, extra
