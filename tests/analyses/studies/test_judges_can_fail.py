"""Every check can fail: rows that nobody measured, scaled and exchanged, change its verdict.

A verdict that is the same whatever is measured rests on a definition, and has to say so. Rows are
made from the plan of each study: a printed number where the source gives one, else a number by
chance, of any column that a check asks for. They are multiplied by 10 and by 0.1, exchanged
between rows, and made alike. What physics alone decides is not found so:
`CONSTRUCTION` is for that.
"""

import zlib
from functools import cache

import numpy as np
import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.framework.runs import Run, Runs, unit_of
from cdpr_drake.analyses.studies.framework.statement import FITTED, GOOD, TEST, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.stability_ranges.question import unit_of_limit

DRAWS = 8
"""Sets of rows that are made of each study."""

MANY, OF_MANY = 200, 2
"""Of a plan with more cases so many sets are made."""

SPREAD = 2.0
"""Logarithms of numbers by chance have this standard deviation."""

SEEDS = (0, 1, 2)
"""Of each case."""

MUTATIONS = {
    "as made": lambda value: value, "10 times": lambda value: 10.0 * value,
    "a tenth": lambda value: 0.1 * value, "alike": np.ones_like,
}  # fmt: skip

ROWS = 40
"""Of a trace."""

TRACES = {
    "time": (), "stability_time": (), "image_deviation": (), "stability_margin": (),
    "taut_cables": (), "jacobian_rank": (), "tensions": (8,), "measured_tensions": (8,),
    "unstrained_lengths": (8,), "cable_velocities": (8,), "image_path": (2,), "camera_path": (3,),
    "error": (6,), "image_line": (2,), "camera_line": (3,),
}  # fmt: skip
"""Traces by name, and the shape of one row."""

WHOLE = {"taut_cables": 9, "jacobian_rank": 7}
"""Traces of whole numbers, and below which."""

TRUTHS = (
    "arrived", "failed", "lost", "placed", "reached", "tag_not_seen", "within",
)  # fmt: skip
"""Columns that are true or false."""

OUTCOMES = ("converged", "target_lost", "timeout")


class Made(dict):
    """A row that has every column that is asked for."""

    def __init__(self, mutation, keys, printed, seed):
        super().__init__()
        self.mutation, self.keys_, self.printed, self.seed = mutation, keys, printed, seed

    def __contains__(self, name):
        return name not in self.keys_ and name != "seed"

    def __missing__(self, name):
        rng = np.random.default_rng([self.seed, zlib.crc32(name.encode())])
        self[name] = value = self._value(name, rng)
        return value

    def _value(self, name, rng):
        if name == "outcome":
            return str(rng.choice(OUTCOMES))
        if name in TRUTHS:
            return bool(rng.integers(2))
        if name in WHOLE:
            top = WHOLE[name]
            alike = self.mutation is MUTATIONS["alike"]
            return np.full(ROWS, top - 1) if alike else rng.integers(top, size=ROWS)
        if name in TRACES:
            return self.mutation(_numbers(rng, (ROWS, *TRACES[name])))
        if name in self.printed:
            try:
                return self.mutation(float(self.printed[name]))
            except ValueError:
                pass
        if not unit_of(name) and rng.integers(2):  # a count, which may be none
            return 0.0
        return self.mutation(float(_numbers(rng, ())))


def _numbers(rng, shape):
    return rng.choice([-1.0, 1.0, 1.0, 1.0], size=shape) * np.exp(rng.normal(0.0, SPREAD, shape))


@cache
def _plan(name):
    study = STUDIES[name].run
    return study.plan(Form()), study.planned(Form())


def answers(name, case):
    """Columns by whose names checks of a study look for what was found."""
    if name != "stability-ranges":
        return ()
    sought = case.keys["sought"].split(", ")[0]
    return (f"searched_{'m3' if sought == 'workspace' else unit_of_limit(sought)}",)


def made_runs(name, mutation, draw, exchanged=False):
    """Rows of all cases of a study; `exchanged`: those that another seed would have."""
    cases, planned = _plan(name)
    rows = []
    for number, case in enumerate(cases):
        for seed in SEEDS if STUDIES[name].run.seeds is not None else (None,):
            printed = {} if exchanged else case.printed
            chance = zlib.crc32(f"{draw} {number} {seed} {exchanged}".encode())
            measured = Made(mutation, case.keys, printed, chance)
            for name_of_answer in answers(name, case):
                measured[name_of_answer]  # there from the start
            rows.append(Run(case.name, seed, case.keys, measured, case.printed))
    return Runs(rows, lambda: planned)


CHECKED = tuple(name for name in STUDIES if getattr(STUDIES[name].run, "checks", ()))
"""Studies of the frame with checks."""


def verdicts(name, checks):
    """By check its verdicts on all made rows, and in what kinds of errors it ended."""
    found = {check.name: set() for check in checks}
    errors = {check.name: set() for check in checks}
    for draw in range(OF_MANY if len(_plan(name)[0]) > MANY else DRAWS):
        sets = [made_runs(name, mutate, draw) for mutate in MUTATIONS.values()]
        for runs in (*sets, made_runs(name, MUTATIONS["as made"], draw, exchanged=True)):
            for check in checks:
                try:
                    found[check.name].add(check.judge(runs).verdict)
                except Exception as problem:
                    errors[check.name].add(type(problem).__name__)
    return found, errors


NOT_MADE = {
    "schemes": {"image_far"},
    "case-1": {"returns", "turns_repeat"},
    "mobile-robot": {
        "drift", "lengths", "corrected", "slack", "same_path", "fails_far_off", "spikes_by_slack",
        "worse_and_worse", "corners", "noticed_early", "first_laps", "underactuated", "takes_part",
        "same_tensions", "only_the_first",
    },
    "case-9": {"eta", "polygon", "outward", "residuals", "sensor_accuracy", "stable"},
    "tension-methods": {"closed_form_steady", "unstable"},
    "stability-recipes": {"rising"},
}  # fmt: skip
"""Checks for which no rows are made here, by study: they ask for poses of a robot, traces of laps,
tables within a row, or whether platforms are lost, or judge printed numbers alone. Tests of their
own make them fail."""

OF_SOURCES = tuple(
    name
    for name in CHECKED
    if any(check.basis in (TEST, FITTED) for check in STUDIES[name].run.checks)
    and name
    not in (
        "worked-examples",
        "stability-shapes",
        "stability-targets",
        "workspaces",
        "pick-and-place",
    )
)
"""Studies that judge a source by numbers in columns; rows of the others are solids, polygons, lists
and counts, and their own tests make each check fail."""


def cannot_fail(name, checks):
    """Checks that hold on all rows that could be made, and those for which none could."""
    found, errors = verdicts(name, checks)
    always = {check.name for check in checks if found[check.name] == {GOOD[check.basis]}}
    return always, {check.name: errors[check.name] for check in checks if not found[check.name]}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", OF_SOURCES)
def test_no_check_of_a_source_holds_whatever_is_measured(name):
    left = NOT_MADE.get(name, ())
    checks = [
        check
        for check in STUDIES[name].run.checks
        if check.basis in (TEST, FITTED) and check.name not in left
    ]
    assert cannot_fail(name, checks) == (set(), {})


def test_a_check_that_cannot_fail_is_found():
    @statement("An error is not imaginary.")
    def real(runs):
        error = runs.mean("position_error_m", configuration="none")
        return Finding(found=f"{error:g}", held=[error**2 >= 0.0])

    @statement("An error is small.")
    def small(runs):
        error = runs.mean("position_error_m", configuration="none")
        return Finding(found=f"{error:g}", held=[abs(error) < 1.0])

    @statement("A column that nobody has.")
    def unknown(runs):
        return Finding(found="", held=[runs.mean("no", where_nobody="is") > 0.0])

    always, none = cannot_fail("case-2", [real, small, unknown])
    assert always == {"real"}
    assert none == {"unknown": {"UnknownName"}}
