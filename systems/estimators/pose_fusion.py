"""Estimates the platform's pose from control, images and cable lengths together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.pose_filter import (
    LENGTHS,
    PoseBelief,
    error_size,
    image_covariance,
    predict,
    start_belief,
    update_image,
    update_known_object,
    update_lengths,
)
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.pose_estimator import PoseEstimator, Read, pack_pose, unpack_pose
from cdpr_drake.systems.estimators.tuning import FusionSettings


@dataclass(frozen=True)
class SeenObject:
    """An object with points that a camera sees.

    Attributes:
        points: Its points in its frame, shape (3, n) [m].
        focal: Focal length of the camera [px].
    """

    points: Array
    focal: float


@dataclass(frozen=True)
class Landmark:
    """An object whose pose is known.

    Attributes:
        seen: How it looks.
        X_WK: Its pose in W [m].
    """

    seen: SeenObject
    X_WK: RigidTransform


class PoseFusion(PoseEstimator):
    """An invariant Kalman filter; see `estimation.pose_filter` for its equations.

    ================= ============== ========== =============================================
    port              type           unit       meaning
    ================= ============== ========== =============================================
    platform_velocity vector(6)      rad/s, m/s in, twist (w, v) of P in P asked for
    measured_lengths  vector(m)      m          in, lengths that the encoders count
    measured_tensions vector(m)      N          in
    X_CO              RigidTransform m          in, pose of the object; unless it moves
    found             vector(1)      -          in, 1 while it is seen; unless it moves
    X_CK              RigidTransform m          in, pose of the known tag; only if there is one
    known_tag_found   vector(1)      -          in, 1 while it is seen; only if there is one
    X_WP              RigidTransform m          out, estimated pose of the platform
    ================= ============== ========== =============================================

    An error of the pose believed at the start is found in motion and removed, since only the true
    pose explains how lengths and images change together. Each image is used once. Delays of the
    camera are not made up for. The known tag is used whenever it is seen.
    """

    def __init__(
        self,
        X_WP0: RigidTransform,
        X_PC: RigidTransform,
        counted: EncoderLengths,
        tuning: FusionSettings,
        rate: float,
        *,
        target: SeenObject | None = None,
        known: Landmark | None = None,
        planar: bool = False,
    ) -> None:
        """A filter that starts from a pose and looks at objects.

        Args:
            X_WP0: Pose believed at the start [m].
            X_PC: Camera on the platform, as believed [m].
            counted: The lengths that the winches count.
            tuning: How far to trust what.
            rate: Control steps per second [Hz].
            target: The object at rest in a pose that is not known; None: images are not used.
            known: An object whose pose is known.
            planar: Whether the platform only moves along x and y of W and turns about z.
        """
        self._m = counted.cables.count
        self._X_PC, self._counted, self._tuning = X_PC, counted, tuning
        self._target, self._known = target, known
        free = np.array([0, 0, 1, 1, 1, 0] if planar else [1] * 6, float)
        angular_velocity, start_rotation, self._camera_rotation = (
            float(np.radians(angle))
            for angle in (
                tuning.angular_velocity_deg, tuning.start_rotation_deg, tuning.camera_rotation_deg
            )
        )  # fmt: skip
        self._motion_noise = free * np.repeat([angular_velocity**2, tuning.velocity**2], 3)
        self._start = free * np.repeat([start_rotation**2, tuning.start_position**2], 3)
        self._first_lengths = cable_paths(X_WP0, counted.cables).lengths
        size = error_size(self._m)
        # Has it begun; was the object seen; X_WO; X_WP0; X_PC; parameters; references; last two
        # images; P.
        parts = [1, 1, 12, 12, 12, 7 * self._m, self._m, 12, 12, size**2]
        self._sizes = np.cumsum(parts)
        super().__init__(X_WP0, rate, np.zeros(self._sizes[-1]))
        self.DeclareVectorInputPort("platform_velocity", 6)
        self.DeclareVectorInputPort("measured_lengths", self._m)
        self.DeclareVectorInputPort("measured_tensions", self._m)
        if target is not None:
            self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
            self.DeclareVectorInputPort("found", 1)
        if known is not None:
            self.DeclareAbstractInputPort("X_CK", Value(RigidTransform()))
            self.DeclareVectorInputPort("known_tag_found", 1)

    def advance(
        self, read: Read, X_WP: RigidTransform, extra: Array, elapsed: float
    ) -> tuple[RigidTransform, Array]:
        """Predicts to now, then takes in images and lengths of now."""
        memory = self._split(extra)
        begun, reference, images = memory[0], memory[6], memory[7:9]
        counted, tensions = read("measured_lengths"), read("measured_tensions")
        if begun[0] == 0.0:
            begun[:] = 1.0
            reference = self._counted.reference(X_WP, counted, tensions)
            belief = self._first_belief(X_WP, tensions)
        else:
            belief = _belief(X_WP, memory)
            drift = np.full(self._m, self._tuning.length_drift**2)
            belief = predict(belief, read("platform_velocity"), elapsed, self._motion_noise, drift)
        belief = self._look(read, belief, images)
        belief = self._count(belief, counted, reference, tensions)
        X_WO = belief.X_WO
        after = np.concatenate(
            [
                begun, [0.0 if X_WO is None else 1.0],
                np.zeros(12) if X_WO is None else pack_pose(X_WO), pack_pose(belief.X_WP0),
                pack_pose(belief.X_PC), belief.parameters, reference, *images,
                belief.covariance.ravel(),
            ]
        )  # fmt: skip
        return belief.X_WP, after

    def between(self, read: Read, X_WP: RigidTransform, elapsed: float) -> RigidTransform:
        """Moves on with the velocity that holds."""
        return X_WP @ exponential(read("platform_velocity") * elapsed)

    def belief(self, context: Context) -> PoseBelief:
        """What the filter believes after its last step, from this system's own context."""
        X_WP, memory = self.memory(context)
        return _belief(X_WP, self._split(memory))

    def _split(self, memory: Array) -> list[Array]:
        return list(np.split(memory.copy(), self._sizes[:-1]))

    def _first_belief(self, X_WP: RigidTransform, tensions: Array) -> PoseBelief:
        t = self._tuning
        slack = np.where(tensions < t.taut, t.start_slack**2, 0.0)
        camera = np.diag(np.repeat([self._camera_rotation**2, t.camera_position**2], 3))
        points = (t.points**2, t.points**2)
        return start_belief(X_WP, self._X_PC, np.diag(self._start), camera, slack, points)

    def _look(self, read: Read, belief: PoseBelief, images: list[Array]) -> PoseBelief:
        """The belief after the images that are new; `images` then holds them."""
        pixel = self._tuning.pixel
        if self._target is not None and read("found")[0] != 0.0:
            X_CO = read("X_CO")
            if _is_new(X_CO, images[0]):
                images[0][:] = pack_pose(X_CO)
                R = image_covariance(X_CO, self._target.points, pixel, self._target.focal)
                belief = update_image(belief, X_CO, R)
        known = self._known
        if known is not None and read("known_tag_found")[0] != 0.0:
            X_CK = read("X_CK")
            if _is_new(X_CK, images[1]):
                images[1][:] = pack_pose(X_CK)
                R = image_covariance(X_CK, known.seen.points, pixel, known.seen.focal)
                belief = update_known_object(belief, known.X_WK, X_CK, R)
        return belief

    def _count(
        self, belief: PoseBelief, counted: Array, reference: Array, tensions: Array
    ) -> PoseBelief:
        cables = self._counted.cables
        now, start = (cable_paths(X, cables) for X in (belief.X_WP, belief.X_WP0))
        change = self._counted.lengths(counted, reference, tensions) - self._first_lengths
        used = tensions >= self._tuning.taut
        variances = np.where(used, self._tuning.length**2, np.inf)
        return update_lengths(
            belief, change, (now.lengths, now.J), (start.lengths, start.J), variances
        )


def _is_new(X: RigidTransform, last: Array) -> bool:
    """Whether a measurement differs from the last one, whose noise no two share."""
    return not np.array_equal(pack_pose(X), last)


def _belief(X_WP: RigidTransform, memory: list[Array]) -> PoseBelief:
    """A belief from the parts of a memory."""
    _, seen, p_WO, p_WP0, p_PC, parameters, _, _, _, P = memory
    size = LENGTHS + len(parameters)
    X_WO = unpack_pose(p_WO) if seen[0] != 0.0 else None
    return PoseBelief(
        X_WP, X_WO, unpack_pose(p_WP0), unpack_pose(p_PC), parameters, P.reshape(size, size)
    )
