"""What has to hold of paths in proven sets, beside other planners."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import CHOICE, OURS, Finding, statement
from cdpr_drake.analyses.studies.proven_paths.measured import FOUND, FREE_FOUND, PARTED

PROBLEM, SAMPLED, FREE = "problem", "sampled", "free motion"
"""Kinds of cases."""

NO_LONGER = 1.05
"""Than RRT* with shortcuts a proven path may be longer by this factor."""

OVER_BOUND = 1.1
"""The same, than the lower bound."""

SOLVER = 1e-6
"""What solvers miss of a length, relative to it."""


@statement(
    "a proven path is infeasible at no sample, by the exact checks of poses",
    rule="0 of all samples",
    basis=OURS,
)
def feasible(runs: Runs) -> Finding:
    """Samples of the paths that were found."""
    paths = runs(kind=PROBLEM, status=FOUND)
    return Finding(
        found=f"{paths.total('infeasible')} of {paths.total('samples')} samples of {len(paths)} "
        "paths",
        held=(paths["infeasible"] == 0).tolist(),
        printed=f"0 of {paths.total('samples')}",
    )


@statement(
    "no path is shorter than its lower bound, nor much longer",
    f"up to {OVER_BOUND:g} times",
    rule="bound <= length up to what the solver misses",
    basis=OURS,
)
def above_bound(runs: Runs) -> Finding:
    """Lengths beside bounds."""
    paths = runs(kind=PROBLEM, status=FOUND)
    shares = paths["length_m"] / paths["bound_m"]
    return Finding(
        found=f"{min(shares):.4f} to {max(shares):.4f} times the bound",
        held=((shares >= 1.0 - SOLVER) & (shares <= OVER_BOUND)).tolist(),
    )


@statement(
    "a path is found, or it is proven that there is none without turns",
    "in every problem",
    basis=OURS,
    cause=CHOICE,
    why="between the ends cells stay open: boxes of poses so small that neither is proven",
)
def settled(runs: Runs) -> Finding:
    """How problems end."""
    problems = runs(kind=PROBLEM)
    open_ones = [_name(run) for run in problems if run["status"] not in (FOUND, PARTED)]
    return Finding(
        found=problems.counted("status") + (f": {', '.join(open_ones)}" if open_ones else ""),
        held=[run["status"] in (FOUND, PARTED) for run in problems],
    )


@statement(
    "a proven path is hardly longer than that of RRT* with shortcuts",
    f"at most {NO_LONGER:g} times",
    rule="the shorter one of our RRT* and OMPL's, where both found a path",
    basis=OURS,
    cause=CHOICE,
    why="RRT* looks at states and passes between them through what a proof excludes, and through "
    "poses that hold and are in no set",
)
def beside_sampling(runs: Runs) -> Finding:
    """Lengths beside those of sampled planners."""
    both = [
        (run["length_m"] / sampled_length(other), other)
        for run, other in beside(runs)
        if run["status"] == FOUND and np.isfinite(sampled_length(other))
    ]
    ratios = np.array([ratio for ratio, _ in both])
    wrong = sum(other["rrt_infeasible"] + other["ompl_infeasible"] > 0 for _, other in both)
    return Finding(
        found=f"{min(ratios):.3f} to {max(ratios):.3f} times in {len(both)}; of the sampled paths "
        f"of {wrong} problems some samples are infeasible"
        if both else "no problem in which both found a path",
        held=(ratios <= NO_LONGER).tolist(),
    )  # fmt: skip


def beside(runs: Runs) -> list[tuple[Run, Run]]:
    """Each problem with what sampled planners found of it."""
    sampled = runs(kind=SAMPLED)
    return [
        (run, sampled.one(robot=run["robot"], scene=run["scene"], number=run["number"]))
        for run in runs(kind=PROBLEM)
    ]


def sampled_length(run: Run) -> float:
    """The shorter one of our RRT* and OMPL's; NaN where neither found a path [m]."""
    lengths = np.array([run["rrt_m"], run["ompl_m"]], float)
    return float(np.fmin.reduce(lengths))


@statement(
    "a proven path is found wherever RRT* finds one",
    "in every such problem",
    basis=OURS,
    cause=CHOICE,
    why="a passage that is narrow beside the smallest boxes is open to samples alone",
)
def finds_what_samples_find(runs: Runs) -> Finding:
    """Problems that sampled planners solve."""
    pairs = [(run, np.isfinite(sampled_length(other))) for run, other in beside(runs)]
    some = [run for run, solved in pairs if solved]
    more = sum(run["status"] == FOUND for run, solved in pairs if not solved)
    return Finding(
        found=f"{sum(run['status'] == FOUND for run in some)} of {len(some)}; and {more} that "
        "RRT* did not solve",
        held=[run["status"] == FOUND for run in some],
    )


@statement(
    "the solver of free motions finds one among the same obstacles, feasible at every sample",
    "in every problem that it is asked for",
    basis=OURS,
    cause=CHOICE,
    why="its program is not convex: it finds what is near its starts, and checks instants",
)
def free_motions(runs: Runs) -> Finding:
    """Free motions of the problems of one robot."""
    free = runs(kind=FREE)
    good = [run["status"] == FREE_FOUND and run["infeasible"] == 0 for run in free]
    times = free["free_s"]
    return Finding(
        found=f"{sum(run['status'] == FREE_FOUND for run in free)} of {len(free)} found, "
        f"{free.total('infeasible')} of {free.total('samples')} samples infeasible; processor time "
        f"{min(times):.0f} to {max(times):.0f} s",
        held=good,
    )


def _name(run: Run) -> str:
    return f"{run['robot']} {run['scene']} {run['number']}"


CHECKS = (
    feasible, above_bound, settled, beside_sampling, finds_what_samples_find, free_motions,
)  # fmt: skip
