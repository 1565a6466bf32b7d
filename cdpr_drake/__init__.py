"""Cable-driven parallel robots in Drake: `import cdpr_drake as cdpr`.

The names of this package are loaded when they are first asked for. Those of most use:

    robot = cdpr.load_robot("acrobot_large")          # or the path of a robot file of yours
    cdpr.solve_tensions(robot)                        # tensions that hold it at its home pose
    cdpr.solve_static(robot, lengths=l0)              # where it hangs with unstrained lengths
    cdpr.compute_workspace(robot, "wrench-feasible", force=5.0)
    cdpr.simulate("acrobot_pbvs", ["duration=5"])     # a visual servo

`cdpr.robot_names()` and `cdpr.scenario_names()` list what comes with the package. Each of these
functions takes a robot by name, by path or as a Robot; a pose as 3 or 6 numbers [m, deg], a
RigidTransform, a matrix of shape (4, 4), a `Pose`, or None for the home pose. Results show
themselves, have `as_dict()`, the same as `cdpr ... --json` prints, and mostly `plot()`. What users
can do wrong raises a `CdprError`.

Conventions hold everywhere and are stated once, here. Units are SI and angles radians unless a name
says otherwise. Drake's monogram notation: `X_WP` is the pose of the platform P in the world W,
`p_WA` the exit points A_i in W with shape (3, m), `p_PB` the anchor points B_i in P with shape
(3, m), `X_PC` the camera C on the platform, `X_CO` the object (tag) O seen by the camera. Spatial
vectors are ordered (rotation, translation), as in Drake, also in Jacobians, wrench matrices and
interaction matrices.

Packages of pure functions take arrays, small dataclasses and RigidTransforms, never a robot file;
`cdpr_drake.models` turns files into those, `cdpr_drake.systems` holds the Drake blocks,
`cdpr_drake.analyses` the runs and studies.

Compiled kernels are cached in the user's cache folder, or where NUMBA_CACHE_DIR says.
"""

import lazy_loader

from cdpr_drake.kernel_cache.folder import use_kernel_cache

use_kernel_cache()

_lazy, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Loads a public name; from then on the first kernel that is compiled is told of, once.

    Raises:
        AttributeError: There is no such name; says the nearest ones.
    """
    try:
        found: object = _lazy(name)
        from cdpr_drake.kernel_cache.first_use import announce_first_use  # commands go without

        announce_first_use()
        return found
    except AttributeError as problem:
        from difflib import get_close_matches

        near = get_close_matches(name, __all__, 3) if name not in __all__ else []
        if not near or name.startswith("__"):
            raise
        words = f"module 'cdpr_drake' has no attribute {name!r}; did you mean {' or '.join(near)}?"
        raise AttributeError(words, name=name) from problem
