"""Design: what moving points of two robots is worth, by proof.

`python design.py 100` searches 100 generations for each robot. ACROBOT shall resist forces of 5 N
along every axis at more poses, CAROCA shall be a stable visual servo at more.
"""

import sys

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.analyses.design import DesignSettings, GoalSettings, MirrorSettings

generations = int(sys.argv[1]) if sys.argv[1:] else 2
for robot, goal, force, anchors in (
    ("acrobot_large", "wrench-feasible", 5.0, 0.0),
    ("caroca", "csw", 0.0, 0.05),
):
    settings = DesignSettings(goals=[GoalSettings(name=goal)], force=force)
    settings.exit_points.reach = np.full(3, 0.1)  # [m], either way along each axis
    settings.anchor_points.reach = np.full(3, anchors)
    settings.mirrors = [MirrorSettings(axis="xy", pairs=["C1-C5", "C2-C6", "C3-C7", "C4-C8"])]
    boxes = 8000 if generations < 20 else 200_000  # of the proof of what was gained
    print(cdpr.optimize_design(robot, parameters=settings, generations=generations, boxes=boxes))
