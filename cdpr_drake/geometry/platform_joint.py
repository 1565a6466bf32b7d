"""The joint by which a platform moves: its frame, its coordinates, and the cables as it sees them.

Simulations take a platform in the coordinates of a joint between a frame F, fixed in W, and a frame
M on the platform, at Po: those of a floating body (3R3T, and 3T and 2R3T, whose spin nothing
excites), of a planar joint in the xy plane of F (2T1R, and 2T, whose turn nothing excites), of a
prismatic one along x of F (1T). Kernels know no frames but these: the cables go to them with exit
points in F and anchor points in M.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_type import MotionType, across

FLOATING, PLANAR, LINE = (13, 6), (6, 3), (2, 1)
"""Numbers of states and of velocities of the joints."""


@dataclass(frozen=True)
class PlatformJoint:
    """The joint between the world and a platform.

    Attributes:
        motion: The platform's motion type.
        X_WF: Frame F; of a horizontal plane with its normal along z, and of a floating body, that
            of W.
        R_PM: Frame M on the platform, at Po.
        height: z of Po in F, of a platform in a plane [m].
    """

    motion: MotionType
    X_WF: RigidTransform
    R_PM: RotationMatrix
    height: float = 0.0

    @staticmethod
    def of(
        motion: MotionType, home: RigidTransform | None = None, plane_height: float | None = None
    ) -> PlatformJoint:
        """The joint of a platform that can be at a pose.

        Args:
            motion: Its motion type.
            home: The pose; the line or the plane goes through it; None: that of W.
            plane_height: Height of a horizontal plane in W [m]; None: that of the pose.
        """
        home = home or RigidTransform()
        p, axis = home.translation(), np.asarray(motion.axis)
        still = RotationMatrix()
        if not (motion.is_plane or motion.num_moves == 1):
            return PlatformJoint(motion, RigidTransform(), still)
        if motion.is_plane and motion.axis == (0.0, 0.0, 1.0):
            height = float(p[2]) if plane_height is None else plane_height
            turn = home.rotation().inverse() if motion.is_point else still
            return PlatformJoint(motion, RigidTransform(), turn, height)
        columns = across(axis)
        if motion.num_moves == 1:
            R = RotationMatrix(np.column_stack([axis, columns]))
            origin = p - axis * (axis @ p)
        else:
            R = RotationMatrix(np.column_stack([columns, axis]))
            origin = axis * (axis @ p)
        turned = home.rotation().inverse() @ R if motion.is_point else R
        return PlatformJoint(motion, RigidTransform(R, origin), turned)

    @property
    def num_states(self) -> int:
        """Numbers of the platform's state: positions and velocities."""
        return self._sizes[0]

    @property
    def num_velocities(self) -> int:
        """Velocities among them; more than degrees of freedom where one is never excited."""
        return self._sizes[1]

    @cached_property
    def _sizes(self) -> tuple[int, int]:
        if self.motion.num_moves == 1:
            return LINE
        return PLANAR if self.motion.is_plane else FLOATING

    @property
    def is_floating(self) -> bool:
        """Whether the platform is a floating body."""
        return self._sizes == FLOATING

    @property
    def is_line(self) -> bool:
        """Whether it slides along a line."""
        return self._sizes == LINE

    def wrench_map(self) -> Array:
        """Generalized forces per wrench on the platform, shape (k, 6), k velocities.

        The wrench is (moment about Po, force) in W; generalized forces are that wrench, (f_x, f_y,
        m_z) in F of a plane, or f_x in F on a line.
        """
        if self.is_floating:
            return np.eye(6)
        R_FW = self.X_WF.rotation().inverse().matrix()
        both = np.zeros((6, 6))
        both[:3, 3:], both[3:, :3] = R_FW, R_FW
        return both[[0, 1, 5] if self.num_velocities == 3 else [0]]

    def turned(self, cables: CableSet) -> CableSet:
        """The cables with exit points and swivel axes in F and anchor points in M."""
        if self.is_as_world():
            return cables
        X_FW, R_MP = self.X_WF.inverse(), self.R_PM.inverse().matrix()
        return replace(
            cables,
            p_WA=X_FW.multiply(cables.p_WA),
            p_PB=R_MP @ cables.p_PB,
            swivel_axis=X_FW.rotation().matrix() @ cables.swivel_axis,
            down=X_FW.rotation().matrix() @ cables.down,
            anchor_swivel_axis=R_MP @ cables.anchor_swivel_axis,
        )

    def is_as_world(self) -> bool:
        """Whether F is W and M is P."""
        return bool(self.X_WF.IsExactlyIdentity() and self.R_PM.IsExactlyIdentity())

    def coordinates(self, X_WP: RigidTransform) -> Array:
        """(x, y, turn) of a platform in a plane, (x,) of one on a line, at a pose [m, rad].

        What the joint cannot do is left out.
        """
        X_FM = self.X_WF.inverse() @ X_WP @ RigidTransform(self.R_PM, np.zeros(3))
        p = X_FM.translation()
        if self.is_line:
            return np.array([p[0]])
        R = X_FM.rotation().matrix()
        return np.array([p[0], p[1], np.arctan2(R[1, 0], R[0, 0])])

    def nearest(self, X_WP: RigidTransform) -> RigidTransform:
        """The pose that the joint can have which `coordinates` says; of a floating body X_WP."""
        if self.is_floating:
            return X_WP
        return self.pose_at(self.coordinates(X_WP))

    def pose_at(self, coordinates: Array) -> RigidTransform:
        """X_WP at coordinates as `coordinates` has them."""
        q = coordinates
        if self.is_line:
            X_FM = RigidTransform(np.array([q[0], 0.0, 0.0]))
        else:
            X_FM = RigidTransform(
                RotationMatrix.MakeZRotation(q[2]), np.array([q[0], q[1], self.height])
            )
        if self.is_as_world():
            return X_FM
        return self.X_WF @ X_FM @ RigidTransform(self.R_PM.inverse(), np.zeros(3))

    def in_frame(self, vector: Array) -> Array:
        """A vector in W, shape (3,), in F."""
        if self.is_as_world():
            return vector
        return np.asarray(self.X_WF.rotation().matrix().T @ vector, float)
