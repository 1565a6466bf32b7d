"""The largest tensions that the Gazebo thesis prints, beside those of starts beside the path."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import product
from typing import TypeVar

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import FITTED, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.tension_methods.start_experiments import (
    ERRORS,
    GAINS,
    LAUNCH,
    ON_PATH,
    ONE_STEP,
    PRINTED,
    RATES,
    START_ERROR,
    error_name,
)
from cdpr_drake.analyses.studies.tension_methods.start_trial import NOTHING, STATIC
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

T = TypeVar("T", bound=tuple[object, ...])

PULSES = ((LAUNCH, STATIC), (LAUNCH, NOTHING), (ON_PATH, STATIC), (ON_PATH, NOTHING))
"""Starts, and what acts between the steps; first as the public code has it."""


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


def _best(found: Mapping[T, Sizes]) -> tuple[T, str]:
    """What meets most printed numbers, the first of several, and how many each meets, in words."""
    counts = {one: sum(met(sizes)) for one, sizes in found.items()}
    return max(counts, key=lambda one: counts[one]), ", ".join(map(str, counts.values()))


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
    found = {
        (error, rate, balance): sizes_of(
            runs, experiment=START_ERROR, start=error, balance=balance, control_rate_hz=rate
        )
        for error, rate, balance in product(map(error_name, ERRORS), RATES, (WRENCH, FORCE))
    }
    best, counts = _best(found)
    error, rate, balance = best
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
        why="Gain times the way of 2 m counts more than the tenth of the time.",
    )


@statement(
    SAYS,
    f"{NUMBERS} N",
    source=PLACES,
    rule=f"{RULE}; forces that act for 1 ms of 10 ms, three rows; of two starts, with and without "
    "tensions of rest, the pair that meets most",
    basis=FITTED,
    same_as="tension-methods/largest_at_launch",
    cause=SOURCE,
)
def largest_one_step_best(runs: Runs) -> Finding:
    """By forces that act a tenth of the time, the best of four."""
    found = {
        (start, between): sizes_of(runs, experiment=ONE_STEP, start=start, between=between)
        for start, between in PULSES
    }
    (start, between), counts = _best(found)
    return Finding(
        found=f"start: {start}, between: {between}: {_words(found[start, between])} N; met by all "
        f"that were tried: {counts}",
        held=met(found[start, between]),
        why="From the path's start ten times the tensions of rest are asked for, at any gain. The "
        "linear program's growth with the gain is not among that.",
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
    all_of = [
        sizes_of(runs, experiment=ONE_STEP, start=start, between=between)[method]
        for start, between in PULSES
    ]
    largest, printed = all_of[0], PRINTED[method]
    others = "; ".join(
        f"start: {start}, between: {between}: {_list(values)} N"
        for (start, between), values in zip(PULSES[1:], all_of[1:], strict=True)
    )
    return Finding(
        why=f"From the place of launch the start error counts more. {others}.",
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
    largest_at_launch, largest_by_forces, largest_by_start_error, largest_one_step,
    largest_one_step_best, one_step_117,
)  # fmt: skip
