"""Where camera and object are fixed: on the platform or in the world."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.features import Sighting


@dataclass(frozen=True)
class CameraMounting:
    """How a camera sees an object.

    Attributes:
        X_BC: Pose of the camera C on its carrier B: the platform P (eye in hand), or the world W
            (eye to hand) [m].
        X_PO: Pose of the object O on the platform, for eye to hand; None: eye in hand [m].
    """

    X_BC: RigidTransform
    X_PO: RigidTransform | None = None

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
