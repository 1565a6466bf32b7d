"""Of all studies: names that they ask for, causes of what does not hold, judges that can fail."""

import ast
import zlib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.framework.case_definition import Configuration, Plan
from cdpr_drake.analyses.studies.framework.runs import Run, Runs, unit_of
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    FITTED,
    GOOD,
    HARDWARE,
    SOURCE,
    TEST,
    Finding,
    judged,
    statement,
)
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.stability_ranges.question import unit_of_limit

# Columns, keys and values that studies ask for: a misspelt one fails here, without a run. A name
# that is asked of runs has to be written where nothing is asked, too: where a row is made, or a
# case planned. Names that are put together there are listed.

ROOT = Path(__file__).parents[3]
ROOMS = ("analyses", "systems", "models", "cdpr_drake")

OF_COLUMNS = {
    "mean", "means", "median", "largest", "smallest", "total", "counts", "counted", "list", "by",
}  # fmt: skip
"""Methods of runs whose arguments are names of columns."""

OF_KEYS = OF_COLUMNS | {"one", "has"}
"""Methods of runs whose keyword arguments are names of columns, with values."""

RUNS = ("runs", "rows", "some", "mine")
"""Names of runs that are called to pick some of them."""

PUT_TOGETHER = {
    "holds_static", "holds_wrench-closure", "certified_poses", "searched_poses", "searched_m3",
    "camera_x_m", "error_m", "r_s_m", "r_pc_m", "theta_u_deg", "camera_turn_deg",
    "m_1",
}  # fmt: skip
"""Columns whose names are made of a kind, a verdict, a method or an error, and a unit, and a
configuration whose name is made of its group and estimator."""


def asked(tree):
    """Nodes that ask runs for something: the node, and the column, key or value."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and is_word(node.slice):
            yield node.slice, node.slice.value
        if not isinstance(node, ast.Call):
            continue
        method = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        if method in OF_COLUMNS:
            yield from ((one, one.value) for one in node.args if is_word(one))
        if method in OF_KEYS or (isinstance(node.func, ast.Name) and node.func.id in RUNS):
            for keyword in node.keywords:
                yield keyword, keyword.arg or ""
                if isinstance(keyword.value, (ast.Constant, ast.Tuple, ast.List)):
                    words = filter(is_word, ast.walk(keyword.value))
                    yield from ((one, one.value) for one in words)


def is_word(node):
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def written(tree, without):
    """Names and words of a file but those of some nodes."""
    for node in ast.walk(tree):
        if id(node) in without:
            continue
        for name in ("id", "arg", "attr", "value"):
            word = getattr(node, name, None)
            if isinstance(word, str):
                yield word


@cache
def names(text):
    """What a file asks for, and the names and words that it writes besides."""
    tree = ast.parse(text)
    mine = list(asked(tree))
    return {word for _, word in mine}, set(written(tree, {id(node) for node, _ in mine}))


@cache
def files():
    """Text of each file of the package."""
    return {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
        if not any(folder.is_symlink() for folder in path.parents)
    }


def unknown(texts):
    """What studies ask for that is written nowhere else."""
    studies = {
        name: names(text) for name, text in texts.items() if name.startswith("analyses/studies/")
    }
    assert len(studies) > 100
    left = set().union(*(some for some, _ in studies.values()))
    left -= PUT_TOGETHER.union({""}, *(words for _, words in studies.values()))
    for text in (text for name, text in texts.items() if name not in studies):
        if any(word in text for word in left):  # only such files are parsed
            left -= names(text)[1]
    return sorted((word, name) for name, (some, _) in studies.items() for word in some & left)


def test_what_studies_ask_for_is_written_where_rows_are_made():
    assert unknown(files()) == []


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ('runs.means("image_max_px"', 'runs.means("image_mx_px"'),
        ('run["outcome"]', 'run["outcom"]'),
        ('runs(configuration="E4")', 'runs(configration="E4")'),
        ('runs(configuration="E4")', 'runs(configuration="E44")'),
    ],
)
def test_a_misspelling_is_found(right, wrong):
    name = "analyses/studies/case_studies/case_6.py"
    text = files()[name]
    assert right in text
    assert len(unknown(files() | {name: text.replace(right, wrong)})) == 1


@pytest.mark.parametrize("name", list(STUDIES))
def test_what_statements_ask_first_is_planned(name):
    """Without any run each ends where it lacks some, and not in a name that nobody planned."""
    study = STUDIES[name].run
    planned = study.planned(Form())
    said = judged(study.checks, Runs((), lambda: planned))
    assert [one.name for one in said] == [check.name for check in study.checks]
    assert [one.found for one in said if "judging failed" in one.found] == []


# What does not hold has a cause: a check of a source names its own before it is run.

UNNAMED = {
    "tension-methods": {"qp_jumps", "unstable"},
    "worked-examples": {
        "two_programs", "homing_tensions", "border_tensions", "equally_tensed", "two_cables_more",
        "polygon_shrinks", "keeps_limits", "pushes",
    },
    "case-9": {"sensor_accuracy"},
}  # fmt: skip
"""Checks of sources that name no cause, by study: where one does not hold, why is not known, or its
finding says so. It may get shorter; a check that is new names a cause."""


@pytest.mark.parametrize("name", STUDIES)
def test_a_check_of_a_source_names_why_it_may_fail(name):
    unnamed = {
        check.name
        for check in getattr(STUDIES[name].run, "checks", ())
        if check.basis in (TEST, FITTED) and not check.cause
    }
    assert unnamed <= UNNAMED.get(name, set())


@pytest.mark.parametrize("name", STUDIES)
def test_printed_numbers_name_why_they_may_differ(name):
    for number in STUDIES[name].numbers:
        assert number.cause in (SOURCE, HARDWARE, CHOICE), number
        assert number.why, number


def outcome_of(held, why=""):
    @statement("It holds.", cause=SOURCE, why="It is not printed.")
    def check(runs):
        return Finding(found="so", held=held, why=why)

    return check.judge(Runs(()))


@pytest.mark.parametrize(
    ("held", "why", "expected"),
    [
        ([False], "", ("source", "It is not printed.")),
        ([False], "It is too far.", ("source", "It is too far.")),
        ([True, False], "", ("source", "It is not printed.")),
        ([True], "", ("", "")),
        ([True], "By a hair.", ("", "By a hair.")),
    ],
)
def test_what_a_check_says_of_a_failure_stands_where_the_finding_says_nothing(held, why, expected):
    found = outcome_of(held, why)
    assert (found.cause, found.why) == expected


def test_an_unknown_cause_is_refused():
    for made in (Configuration, lambda *names, cause: replace(PLAN, cause=cause)):
        with pytest.raises(ValueError, match="cause"):
            made("a", "a", cause="weather")


PLAN = Plan(
    name="made-up",
    title="Made up",
    scenario="acrobot_pbvs",
    configurations=(
        Configuration("a", "a", published={"outcome": "converged"}),
        Configuration("b", "b", published={"outcome": "converged"}, why="Far.", cause=HARDWARE),
    ),
    why="Not printed.",
    cause=SOURCE,
)


def test_a_configuration_s_cause_goes_before_that_of_all():
    told = [(number.why, number.cause) for number in PLAN.published()]
    assert told == [("Not printed.", SOURCE), ("Far.", HARDWARE)]
    assert [(case.why, case.cause) for case in PLAN(Form())] == told


# Every check can fail: rows that nobody measured, scaled and exchanged, change its verdict.
#
# A verdict that is the same whatever is measured rests on a definition, and has to say so. Rows are
# made from the plan of each study: a printed number where the source gives one, else a number by
# chance, of any column that a check asks for. They are multiplied by 10 and by 0.1, exchanged
# between rows, and made alike. What physics alone decides is not found so: `CONSTRUCTION` is for
# that.

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


def sets_of(name):
    """All sets of rows that are made of a study."""
    for draw in range(OF_MANY if len(_plan(name)[0]) > MANY else DRAWS):
        for mutate in MUTATIONS.values():
            yield made_runs(name, mutate, draw)
        yield made_runs(name, MUTATIONS["as made"], draw, exchanged=True)


NOT_MADE = {
    "case-9": {"eta", "polygon", "outward", "residuals", "sensor_accuracy", "stable"},
    "tension-methods": {"closed_form_steady", "unstable"},
}  # fmt: skip
"""Checks for which no rows are made here, by study: they ask for poses of a robot, traces of laps,
tables within a row, or whether platforms are lost, or judge printed numbers alone. Tests of their
own make them fail."""

OTHER_ROWS = (
    "worked-examples",
)  # fmt: skip
"""Studies whose rows are solids, polygons, lists and counts; their own tests make each check
fail."""


def of_sources(name):
    """Checks of a source, by numbers in columns."""
    checks = getattr(STUDIES[name].run, "checks", ()) if name not in OTHER_ROWS else ()
    return [check for check in checks if check.basis in (TEST, FITTED)]


def cannot_fail(name, checks):
    """Checks that hold on all rows that could be made, and those for which none could.

    One that has failed once is asked no more.
    """
    left, errors = {check.name: check for check in checks}, {}
    judged_once = set()
    for runs in sets_of(name):
        for check in tuple(left.values()):
            try:
                verdict = check.judge(runs).verdict
            except Exception as problem:
                errors.setdefault(check.name, set()).add(type(problem).__name__)
                continue
            judged_once.add(check.name)
            if verdict != GOOD[check.basis]:
                del left[check.name]
        if not left:
            break
    always = left.keys() & judged_once
    return always, {one: errors[one] for one in left.keys() - judged_once}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", [name for name in STUDIES if of_sources(name)])
def test_no_check_of_a_source_holds_whatever_is_measured(name):
    left = NOT_MADE.get(name, ())
    checks = [check for check in of_sources(name) if check.name not in left]
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
