"""Questions of the study of stability ranges, as cases, and their answers, in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.study import Case

PLANAR_VISION = "3.2.1, planar: analyses I and II"
PLANAR_ROBOT = "3.2.1, planar: analysis III"
SPATIAL_VISION = "3.2.2, spatial: analysis I"
SPATIAL_CAMERA = "3.2.2, spatial: analysis II"
SPATIAL_ROBOT = "3.2.2, spatial: analysis III"
SINGLE = "3.4.2, one wrong parameter"
SECTIONS = (
    PLANAR_VISION, PLANAR_ROBOT, SPATIAL_VISION, SPATIAL_CAMERA, SPATIAL_ROBOT, SINGLE,
)  # fmt: skip
"""Sections of the servoing thesis."""

ANGLES = ("psi", "phi", "theta", "theta_u", "camera_turn")
"""Limits that are angles, beside those whose names begin with d_theta; the others are lengths."""

Answer = dict[str, float]
"""What a question gives, by column: found, searched, certified, sampled, with their unit."""


def unit_of_limit(limit: str) -> str:
    """Unit of a limit, as names of columns end with it."""
    return "deg" if limit in ANGLES or limit.startswith("d_theta") else "m"


def question(
    name: str,
    section: str,
    group: str,
    limits: Mapping[str, float],
    sought: str,
    compute: partial[Answer],
    **printed: float,
) -> Case:
    """A question as a case; it depends on no other.

    Args:
        name: Name, unique in the study.
        section: One of `SECTIONS`.
        group: Questions that differ in one limit share it.
        limits: What is given [m, deg].
        sought: Name of what is sought.
        compute: Answers it; a function of a module with its arguments, so that it pickles.
        printed: By column what the thesis says.
    """
    return Case(
        name=name,
        keys={
            "section": section, "group": group, "sought": sought,
            **{f"{limit}_{unit_of_limit(limit)}": value for limit, value in limits.items()},
        },
        data=compute,
        printed={column: f"{value:g}" for column, value in printed.items()},
    )  # fmt: skip


def measure(case: Case, seed: int) -> Answer:
    """The answers of a question."""
    answers: Answer = case.data()
    return answers


def bisected(stable: Callable[[float], bool], high: float, step: float) -> float:
    """The largest multiple of step up to high at which `stable` holds, by bisection; 0 if none."""
    low, top = 0, round(high / step)
    if stable(top * step):
        return top * step
    while top - low > 1:
        middle = (low + top) // 2
        low, top = (middle, top) if stable(middle * step) else (low, middle)
    return low * step


def limits_of(run: Run) -> dict[str, float]:
    """What was given, by names without units [m, deg]."""
    return {
        column.rpartition("_")[0]: value
        for column, value in run.keys.items()
        if column not in ("section", "group", "sought")
    }


def column_of(run: Run) -> str:
    """The column of the answer that counts: the searched one where there are several."""
    for start in ("found_", "searched_", "sampled_"):
        for column in run.measured:
            if column.startswith(start):
                return column
    return next(iter(run.measured))


def found(run: Run) -> float:
    """The answer that counts."""
    return float(run[column_of(run)])


def published(run: Run) -> float | None:
    """What the thesis says; None: nothing."""
    return next(map(float, run.printed.values()), None)


def group(runs: Runs, section: str, name: str, least: int = 2) -> Runs:
    """Questions of a group, in their order.

    Raises:
        MissingRuns: There are fewer than `least`.
    """
    some = runs(section=section, group=name)
    if len(some) < least:
        raise MissingRuns(name)
    return some


NESTED = (
    "Limits are sets with everything within, so a smaller one cannot allow less: not that the "
    "limit falls was found, but that it is not constant."
)
"""Why such an order is no discovery."""

FALLS = "from one limit to the next it never rises, and the last is below the first"
"""When something falls."""


def falls(runs: Runs) -> bool:
    """Whether what was found never rises and ends below where it begins."""
    values = [found(run) for run in runs]
    return all(b <= a + 1e-9 for a, b in pairwise(values)) and ends_lower(runs)


def ends_lower(runs: Runs) -> bool:
    """Whether the last that was found is below the first."""
    return found(runs.rows[-1]) < found(runs.rows[0])


def listed(runs: Runs) -> str:
    """What was found in each row, in words."""
    return ", ".join(f"{found(run):.3g}" for run in runs)


def pairs(runs: Runs, limit: str, unit: str) -> str:
    """Words such as `0.15 at 0 m, 0.1 at 0.3 m [m]`: found at each value of a limit."""
    words = (f"{found(run):.3g} at {limits_of(run).get(limit, 0.0):g} {unit}" for run in runs)
    return f"{', '.join(words)} [{column_of(runs.rows[0]).rpartition('_')[2]}]"
