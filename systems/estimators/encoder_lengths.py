"""Cable lengths as an estimator knows them: counted by the winches from a pose believed once."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables import stretched_lengths, unstrained_lengths
from cdpr_drake.geometry import CableSet, cable_paths


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
