"""The largest tensions that the Gazebo thesis prints, beside those of starts beside the path."""

from __future__ import annotations

from collections.abc import Iterable

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import FITTED, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.tension_methods.start_experiments import (
    ERRORS,
    GAINS,
    LAUNCH,
    ONE_STEP,
    PRINTED,
    RATES,
    START_ERROR,
    error_name,
)
from cdpr_drake.analyses.studies.tension_methods.start_trial import STATIC
from cdpr_drake.control.force_balance import FORCE, WRENCH

FACTOR = 2.0
"""A largest tension is the printed one within this factor, below or above."""

SAME = 0.01
"""Largest tensions are the same at all gains within this share."""

SAYS = "The largest tensions by method and gain."

NUMBERS = "; ".join(
    f"{method.replace('_', ' ')} {', '.join(f'{one:g}' for one in values)}"
    for method, values in PRINTED.items()
)
"""The printed ones, in words."""

PLACES = "Gazebo thesis 6.4.1 to 6.4.4"

RULE = f"each of the twelve within a factor {FACTOR:g}, over the whole run"

Sizes = dict[str, list[float]]


def sizes_of(runs: Runs, **where: object) -> Sizes:
    """Largest tensions by method, at the printed gains [N].

    Raises:
        MissingRuns: A run is not there.
    """
    return {
        method: [
            runs.one(method=method, kp_per_s2=gain, **where)["tension_max_n"] for gain in GAINS
        ]
        for method in PRINTED
    }


def met(sizes: Sizes) -> list[bool]:
    """Of each printed number, whether it is met."""
    return [
        printed / FACTOR <= found <= printed * FACTOR
        for method, values in PRINTED.items()
        for found, printed in zip(sizes[method], values, strict=True)
    ]


def _words(sizes: Sizes) -> str:
    return "; ".join(
        f"{method.replace('_', ' ')} {_list(values)}" for method, values in sizes.items()
    )


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


@statement(
    SAYS,
    f"{NUMBERS} N",
    source=PLACES,
    rule=f"{RULE}; from the place of launch, six rows, 1 kHz: as the thesis writes its control",
    cause=SOURCE,
)
def largest_at_launch(runs: Runs) -> Finding:
    """From the place of launch, by the whole wrench."""
    sizes = sizes_of(
        runs, experiment=START_ERROR, start=LAUNCH, balance=WRENCH, control_rate_hz=RATES[0]
    )
    return Finding(
        found=f"{_words(sizes)} N",
        held=met(sizes),
        why="Gain times the way of 2 m from the place of launch asks for more than is printed.",
    )


@statement(
    SAYS,
    f"{NUMBERS} N",
    source=PLACES,
    rule=f"{RULE}; from the place of launch, three rows, 100 Hz: as the public code has it",
    same_as="tension-methods/largest_at_launch",
    cause=SOURCE,
)
def largest_by_forces(runs: Runs) -> Finding:
    """From the place of launch, by forces alone."""
    sizes = sizes_of(
        runs, experiment=START_ERROR, start=LAUNCH, balance=FORCE, control_rate_hz=RATES[1]
    )
    return Finding(
        found=f"{_words(sizes)} N",
        held=met(sizes),
        why="At 100 Hz gains of 800 and more are unstable, and tensions grow to their bounds.",
    )


@statement(
    SAYS,
    f"{NUMBERS} N",
    source=PLACES,
    rule=f"{RULE}; of start errors of 0.3 to 0.6 m, both rates, six rows or three, the one that "
    "meets most",
    basis=FITTED,
    same_as="tension-methods/largest_at_launch",
    cause=SOURCE,
)
def largest_by_start_error(runs: Runs) -> Finding:
    """From a start beside the path, the best of all."""
    found = {}
    for error in map(error_name, ERRORS):
        for rate in RATES:
            for balance in (WRENCH, FORCE):
                found[error, rate, balance] = sizes_of(
                    runs, experiment=START_ERROR, start=error, balance=balance,
                    control_rate_hz=rate,
                )  # fmt: skip
    best = max(found, key=lambda one: sum(met(found[one])))
    error, rate, balance = best
    counts = ", ".join(str(sum(met(one))) for one in found.values())
    return Finding(
        found=f"{error}, {rate:g} Hz, {balance}: {_words(found[best])} N; met by all that were "
        f"tried: {counts}",
        held=met(found[best]),
        why="The start error was chosen with the numbers in sight.",
    )


@statement(
    SAYS,
    f"{NUMBERS} N",
    source=PLACES,
    rule=f"{RULE}; forces that act for 1 ms of 10 ms beside the tensions of rest, three rows, from "
    "the place of launch: as the public code has it",
    same_as="tension-methods/largest_at_launch",
    cause=SOURCE,
)
def largest_one_step(runs: Runs) -> Finding:
    """By forces that act a tenth of the time."""
    sizes = sizes_of(runs, experiment=ONE_STEP, start=LAUNCH, between=STATIC)
    return Finding(
        found=f"{_words(sizes)} N",
        held=met(sizes),
        why="Of the public code's version of that time nothing is known for sure.",
    )


@statement(
    "The pseudo-inverse's largest tension is the same at all three gains.",
    "117 N",
    source="Gazebo thesis 6.4.3",
    rule=f"the same within {100.0 * SAME:g} %; the printed one within a factor {FACTOR:g}; forces "
    "that act for 1 ms of 10 ms, as the public code has it",
    same_as="tension-methods/pseudo_inverse_117",
    cause=SOURCE,
)
def one_step_117(runs: Runs) -> Finding:
    """The pseudo-inverse's largest tension, where forces act a tenth of the time."""
    method = "pseudo_inverse"
    sizes = sizes_of(runs, experiment=ONE_STEP, start=LAUNCH, between=STATIC)
    largest, printed = sizes[method], PRINTED[method]
    return Finding(
        found=f"{_list(largest)} N",
        held=[
            max(largest) - min(largest) < SAME * max(largest),
            all(
                one / FACTOR <= found <= one * FACTOR
                for found, one in zip(largest, printed, strict=True)
            ),
        ],
    )


START_CHECKS = (
    largest_at_launch, largest_by_forces, largest_by_start_error, largest_one_step, one_step_117,
)  # fmt: skip
