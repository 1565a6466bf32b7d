"""Proven paths: how long they are beside the straight line, which no path is shorter than.

`python proven_paths.py 9` plans in nine scenes, two problems in each: drawn positions with an
obstacle on the straight line between them.
"""

import sys
from itertools import islice, product

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.analyses.planning.robot_path_task import path_task
from cdpr_drake.proofs.robot_sets import ProofSettings, ProvenSets
from cdpr_drake.workspaces.cable_interference import box_row

ROBOTS = {"caroca": 0.1, "macarm": 1.0, "ipanema_1": 0.5}  # accelerations that are proven [m/s^2]
SCENES = {  # middles and sizes of boxes, as shares of the robot's frame
    "wall": [((0.5, 0.5, 0.15), (0.04, 0.35, 0.3))],
    "pillars": [((0.42, 0.42, 0.18), (0.05, 0.05, 0.36)), ((0.58, 0.6, 0.18), (0.05, 0.05, 0.36))],
    "shelf": [((0.5, 0.5, 0.27), (0.3, 0.15, 0.02)), ((0.36, 0.5, 0.13), (0.02, 0.15, 0.26)),
              ((0.64, 0.5, 0.13), (0.02, 0.15, 0.26))],
}  # fmt: skip


def is_blocked(sets, start, goal):
    """True if a level platform fails an exact check on the straight line."""
    places = np.linspace(start, goal, 200)
    checks = sets.judge(places, np.tile(np.eye(3), (len(places), 1, 1)))
    return not all(np.all(holds) for holds in checks.values())


random = np.random.default_rng(0)
count = int(sys.argv[1]) if sys.argv[1:] else 1
print("robot, scene, straight [m], proven [m], bound [m], time [s], samples that fail")
for name, scene in list(product(ROBOTS, SCENES))[:count]:
    robot = cdpr.load_robot(name)
    low, high = robot.reach()
    boxes = [box_row(low + m * (high - low), s * (high - low)) for m, s in np.array(SCENES[scene])]
    limits = path_task(robot, reserve=0.05).limits
    proof = ProofSettings(boxes=150_000, cells=2**18, limits=(limits.lower, limits.upper))
    sets = ProvenSets.find(robot, None, None, np.array(boxes), ROBOTS[name], settings=proof)
    pairs = (
        (start, goal) for start, goal in random.uniform(low, high, (6000, 2, 3))
        if np.linalg.norm(goal - start) > 0.25 * np.linalg.norm(high - low)
        and all(sets.covers(np.append(p, np.zeros(3))) for p in (start, goal))
        and is_blocked(sets, start, goal)
    )  # fmt: skip
    for start, goal in islice(pairs, 2):
        words = f"{name}, {scene}, {np.linalg.norm(goal - start):.3f}"
        try:
            run = cdpr.plan_proven_motion(robot, start, goal, sets=sets)
            lengths = f"{run.in_sets.path.length:.3f}, {run.in_sets.path.lower_bound:.3f}"
            print(f"{words}, {lengths}, {run.solution.duration:.1f}, {sum(run.judged[1].values())}")
        except cdpr.CdprError as refusal:
            print(f"{words}: {refusal}")
