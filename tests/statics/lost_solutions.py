"""Random problems solved twice: by paths to all solutions, and by a dense multi-start.

    python -m tests.statics.lost_solutions --problems 1000 --seed 0 --searches 200

The multi-start knows nothing of polynomials: it searches pose and tensions from random poses with
random sets of taut cables. What it finds has to be among the poses of rest that paths lead to.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np

from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_search import sample_equilibria
from tests.statics.hanging import random_problem

NEAR = 1e-4
"""Poses nearer than this [m, rad] are one: searches end at forces of 1e-10."""


@dataclass
class Counts:
    """Problems; those without a pose; poses by paths; those also found by searches; lost poses."""

    problems: int = 0
    none: int = 0
    poses: int = 0
    searched: int = 0
    lost: int = 0
    lost_paths: int = 0
    unproven: int = 0


def lost(problems, seed, searches, say=None, first=0):
    """Counts of random problems: planar ones on 1 to 4 cables, spatial ones on 1 to 4."""
    counts = Counts()
    for number in range(first, first + problems):
        random = np.random.default_rng([seed, number])
        cables, upright = 1 + number % 4, (number // 4) % 2 == 0
        if not upright and cables == 4 and number % 16 >= 8:
            cables = 3  # four cables in space take 984 paths
        platform, lengths = random_problem(random, cables, upright)
        counts.problems += 1
        try:
            found = enumerate_equilibria(platform, lengths)
            rests, counts.lost_paths = found.rests, counts.lost_paths + found.paths.lost
        except EquilibriumError:
            rests, counts.none = [], counts.none + 1
        counts.poses += len(rests)
        counts.unproven += sum(str(one.certificate) == "numerical" for one in rests)
        try:
            others = sample_equilibria(
                platform, lengths, elastic=False, most=searches, seed=number
            ).rests
        except EquilibriumError:
            others = []
        for other in others:
            if any(_same(one, other) for one in rests):
                counts.searched += 1
            else:
                counts.lost += 1
                if say:
                    say(f"problem {number}: lost {other}")
        if say:
            say(f"{counts.problems} of {problems}: {counts}")
    return counts


def _same(one, other):
    if one.family:  # of which the search finds any
        return abs(one.energy - other.energy) < NEAR * 10.0
    distance, angle = pose_error(one.X_WP, other.X_WP)
    return distance < NEAR and angle < NEAR


def main():
    """The long form."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="number of the first problem")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--searches", type=int, default=200)
    given = parser.parse_args()
    began = time.monotonic()
    counts = lost(given.problems, given.seed, given.searches, print, given.first)
    print(f"{counts}, {time.monotonic() - began:.0f} s")
    raise SystemExit(counts.lost > 0)


if __name__ == "__main__":
    main()
