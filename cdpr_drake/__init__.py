"""Pure functions for cable-driven parallel robots, and the `cdpr` command.

Conventions hold everywhere and are stated once, here. Units are SI and angles radians unless a name
says otherwise. Drake's monogram notation: `X_WP` is the pose of the platform P in the world W,
`p_WA` the exit points A_i in W with shape (3, m), `p_PB` the anchor points B_i in P with shape
(3, m), `X_PC` the camera C on the platform, `X_CO` the object (tag) O seen by the camera. Spatial
vectors are ordered (rotation, translation), as in Drake, also in Jacobians, wrench matrices and
interaction matrices.

Packages of pure functions take arrays, small dataclasses and RigidTransforms, never a robot file;
`cdpr_drake.models` turns files into those, `cdpr_drake.systems` holds the Drake blocks,
`cdpr_drake.analyses` the runs, studies and benchmarks.

Compiled kernels are cached in the user's cache folder, or where NUMBA_CACHE_DIR says.
"""

from cdpr_drake.kernel_cache.folder import use_kernel_cache

__all__: list[str] = []

use_kernel_cache()
