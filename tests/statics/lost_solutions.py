"""Random problems solved twice: by paths to all solutions, and by a dense multi-start.

    python -m tests.statics.lost_solutions --problems 1000 --seed 0 --searches 200

The multi-start knows nothing of polynomials: it searches pose and tensions from random poses with
random sets of taut cables. What it finds has to be among the poses of rest that paths lead to.
"""

import argparse

import numpy as np

from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_search import sample_equilibria
from tests.statics.statics_cases import random_problem

NEAR = 1e-4
"""Poses nearer than this [m, rad] are one: searches end at forces of 1e-10."""


def lost(problems, seed, searches, first=0):
    """Numbers of poses by paths, and what only searches find: (problem, pose of rest).

    Of planar problems on 1 to 4 cables, and of spatial ones on 1 to 4.
    """
    poses, missing = 0, []
    for number in range(first, first + problems):
        random = np.random.default_rng([seed, number])
        cables, upright = 1 + number % 4, (number // 4) % 2 == 0
        if not upright and cables == 4 and number % 16 >= 8:
            cables = 3  # four cables in space take 984 paths
        platform, lengths = random_problem(random, cables, upright)
        try:
            rests = enumerate_equilibria(platform, lengths).rests
        except EquilibriumError:
            rests = []
        try:
            how = {"elastic": False, "most": searches, "seed": number}
            others = sample_equilibria(platform, lengths, **how).rests
        except EquilibriumError:
            others = []
        poses += len(rests)
        unknown = [other for other in others if not any(_same(rest, other) for rest in rests)]
        missing += [(number, other) for other in unknown]
    return poses, missing


def _same(rest, other):
    if rest.family:  # of which the search finds any
        return abs(rest.energy - other.energy) < NEAR * 10.0
    distance, angle = pose_error(rest.X_WP, other.X_WP)
    return distance < NEAR and angle < NEAR


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("problems", 1000), ("first", 0), ("seed", 0), ("searches", 200)):
        parser.add_argument(f"--{name}", type=int, default=default)
    poses, missing = lost(**vars(parser.parse_args()))
    print(f"{poses} poses; lost: {missing}")
    raise SystemExit(bool(missing))
