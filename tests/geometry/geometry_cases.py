"""Vectors, poses and twists by hypothesis, eight cables without symmetry, and differences."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import rotation_from_vector

few = settings(max_examples=40)

share = st.floats(-1.0, 1.0)
vector = st.tuples(share, share, share).map(np.array)
twist = st.tuples(*[share] * 6).map(np.array)
unit = vector.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
poses = st.builds(
    lambda turn, p: RigidTransform(rotation_from_vector(3.0 * turn), [0, 0, 0.95] + 0.45 * p),
    vector, vector,
)  # fmt: skip

P_WA = np.array([(x, y, z) for x in (-1.0, 1.1) for y in (-0.9, 1.0) for z in (0.0, 1.9)]).T
P_PB = np.array([(x, y, z) for x in (0.1, -0.11) for y in (-0.1, 0.12) for z in (0.08, 0.0)]).T
"""From the corners of a box of 2 m to a platform of 0.2 m."""


def moved(X_WP, V_WP, time):
    """A pose after moving at a spatial velocity (w, v of Po) in W."""
    R = rotation_from_vector(time * V_WP[:3])
    return RigidTransform(R @ X_WP.rotation(), X_WP.translation() + time * V_WP[3:])


def slopes(function, X_WP, step=1e-6):
    """Central differences of a function of the pose along the six twists, in the last axis."""
    ends = [[function(moved(X_WP, V, k * step)) for k in (1, -1)] for V in np.eye(6)]
    return np.stack([(np.array(a) - np.array(b)) / (2.0 * step) for a, b in ends], axis=-1)
