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
    return Finding(
        found=_by_robot(
            some,
            lambda one: (
                f"{1e3 * one.one()['certified_s']:.2f} and {1e3 * one.one()['simulated_s']:.2f}, "
                f"{1e3 * one.one()['lipschitz_s']:.3f} and {1e3 * one.one()['sampled_s']:.3f} ms"
            ),
        ),
        held=[
            held
            for run in some
            for held in (
                run["certified_s"] <= run["simulated_s"], run["lipschitz_s"] <= run["sampled_s"],
            )
        ],
    )  # fmt: skip


CHECKS = (
    _no_false_claims,
    _certificate_proves_most,
    _falls_where_certified,
    _arrives_from_certified,
    _proofs_are_cheap,
)
