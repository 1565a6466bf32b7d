"""Without swing: what a motion leaves of it on soft cables, with shaped commands and by shooting.

`python without_swing.py 20` also tries cables whose stiffness is 20 % off what was planned with.
"""

import sys

from pydrake.math import RigidTransform

from cdpr_drake.analyses.planning import plan_shot_rest
from cdpr_drake.analyses.planning.input_shaping import plan_shaped_rest, simulate_swing
from cdpr_drake.analyses.planning.rest_to_rest import example_robot
from cdpr_drake.planning.input_shaping import SHAPERS
from cdpr_drake.systems.robots.settings import CableSettings

off = float(sys.argv[1]) / 100.0 if sys.argv[1:] else 0.1
robot = example_robot()  # planar, on four cables of rubber
ends = RigidTransform([-0.1, 0.05, 0.3]), RigidTransform([0.15, -0.05, 0.3])
duration, bounds = 0.45, (10.0, 60.0)  # before it is shaped [s]; tensions [N]
motions = {
    name or "not shaped": plan_shaped_rest(robot, *ends, duration, name, bounds=bounds)
    for name in (None, *SHAPERS)
}
for name, ratios in {"shooting": (1.0,), "robust shooting": (1.0 - off, 1.0, 1.0 + off)}.items():
    motions[name] = plan_shot_rest(robot, *ends, 1.5 * duration, bounds=bounds, ratios=ratios)
print(f"ends after [s], swing left [mm]: as planned, with stiffness {100 * off:.0f} % off")
for name, motion in motions.items():
    left = [
        1e3 * simulate_swing(motion, 2.0, CableSettings(stiffness_ratio=ratio)).left()
        for ratio in (1.0, 1.0 - off, 1.0 + off)
    ]
    print(f"{name:15} {motion.end_time:.3f} {left[0]:8.4f} {max(left[1:]):8.3f}")
