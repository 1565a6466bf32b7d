"""What has to hold between the methods."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.stability_bounds.questions import (
    COSTS,
    LOOPS,
    PROOFS,
    SHARES,
    THESIS,
)


def _by_robot(runs: Runs, words: Callable[[Runs], str]) -> str:
    return "; ".join(f"{robot}: {words(some)}" for robot, some in runs.by("robot"))


def _at_thesis(runs: Runs) -> Runs:
    return runs(experiment=SHARES, scale=THESIS)


@statement(
    "No proof claims a pose for which an unstable error is known.",
    "0 poses",
    rule="none of any robot under any bounds, for each proof; two searches with different seeds",
    basis=OURS,
)
def _no_false_claims(runs: Runs) -> Finding:
    some = runs(experiment=SHARES)
    counts = {name: some.total(f"{name}_false") for name in PROOFS}
    return Finding(
        found=", ".join(f"{name} {count:g}" for name, count in counts.items())
        + f" false claims at {some.total('poses'):g} poses",
        held=[count == 0 for count in counts.values()],
    )


@statement(
    "The certificate proves at least as much as intervals and as constants of Lipschitz.",
    rule="volume of each robot under each bounds not below that of either",
    basis=OURS,
)
def _certificate_proves_most(runs: Runs) -> Finding:
    some = runs(experiment=SHARES)
    return Finding(
        found="certified, Lipschitz, intervals at D_b: "
        + _by_robot(_at_thesis(runs), lambda one: _shares(one.one())),
        held=[
            run["certified_percent"] >= max(run["lipschitz_percent"], run["interval_percent"])
            for run in some
        ],
    )


def _shares(run: Run) -> str:
    return ", ".join(f"{run[f'{name}_percent']:.1f}" for name in PROOFS) + " %"


@statement(
    "At a certified pose the error of every loop falls.",
    "0 loops",
    rule="of no loop of any robot under any bounds it rises at the start, nor on its way at a pose "
    "that is certified",
    basis=OURS,
)
def _falls_where_certified(runs: Runs) -> Finding:
    some = runs(experiment=SHARES)
    rising, against = some.total("rising_at_start"), some.total("contradictions")
    return Finding(
        found=f"{rising:g} of {some.total('certified_loops'):g} loops from certified poses rise at "
        f"the start, {against:g} on their way at a certified pose",
        held=[rising == 0, against == 0],
    )


@statement(
    "From a certified pose every loop reaches its goal, as (3.27) has it.",
    "all",
    source="servoing thesis (3.27), 3.4",
    rule="every loop of each robot under the thesis' bounds",
    basis=OURS,
    cause=SOURCE,
)
def _arrives_from_certified(runs: Runs) -> Finding:
    some = _at_thesis(runs)
    return Finding(
        found=_by_robot(
            some, lambda one: f"{one.total('arrived'):g} of {one.total('certified_loops'):g}"
        ),
        held=[run["arrived"] == run["certified_loops"] for run in some],
        why="The criterion speaks of one pose: a way may leave the workspace, and the frame.",
    )


@statement(
    f"A certificate costs no more than {LOOPS} loops that are simulated from the pose, and the "
    "constants of Lipschitz no more than the samples.",
    rule="processor time for a pose under the thesis' bounds, of each robot",
    basis=OURS,
)
def _proofs_are_cheap(runs: Runs) -> Finding:
    some = runs(experiment=COSTS)
    pairs = (("certified", "simulated"), ("lipschitz", "sampled"))
    held = {
        names: {run["robot"]: run["seconds"][names[0]] <= run["seconds"][names[1]] for run in some}
        for names in pairs
    }
    words = (
        f"{first} not above {second}: "
        + (", ".join(robot for robot, good in held[first, second].items() if good) or "no robot")
        for first, second in pairs
    )
    return Finding(
        found="; ".join(words),  # times are in the table: they are no results
        held=[good for robots in held.values() for good in robots.values()],
        why="The search before a certificate looks at as many samples as the sampled verdict, 1000 "
        "for the planar robot, 50 else; samples are compiled, the constants are not.",
    )


CHECKS = (
    _no_false_claims,
    _certificate_proves_most,
    _falls_where_certified,
    _arrives_from_certified,
    _proofs_are_cheap,
)
