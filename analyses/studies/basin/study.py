"""Study: where does visual servoing converge from, and how much of it does the criterion promise?

ACROBOT with its large platform sees a tag in the middle of the floor and goes to 0.3 m above it,
with a model as wrong as the bounds allow, in directions by chance: estimate of the first pose,
mounting of the camera, exit and anchor points. Starts fill the workspace and turns evenly. Loops
have masses, elastic cables that go slack, a camera of finite view, an estimate that integrates
commands. Of every start each verdict on stability under the same bounds is asked.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cdpr_drake.analyses.studies.basin.figures import FIGURES
from cdpr_drake.analyses.studies.basin.loops import (
    CERTIFIED,
    CONVERGED,
    ENDS,
    WAY_POSES,
    BasinTask,
    reduce,
)
from cdpr_drake.analyses.studies.basin.starts import (
    OPTIONS,
    ROBOT,
    SCHEMES,
    SEED,
    SETTINGS,
    TILT_DEG,
    YAW_DEG,
    basin_setup,
)
from cdpr_drake.analyses.studies.basin.statements import CHECKS, failed
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.stability.verdict import VERDICTS

BLOCKS, POINTS = 280, 1000
"""Blocks of the sequence of starts, and points of a block: a hundred thousand loops of a scheme,
since the platform is held and the tag is seen at rather more than a third of the points."""

QUICK_BLOCKS, QUICK_POINTS = 1, 40

CHUNK = 50
"""Points that are computed at once."""

ASSUMPTIONS = (
    "Errors of the model have the full size of the servoing thesis' bounds, one draw for a start; "
    "the verdicts judge all errors within these bounds.",
    f"Starts are turned by up to {TILT_DEG:g} deg about x and y and {YAW_DEG:g} deg about z.",
    "Exact interaction matrices, no noise of images, ideal winches, no tension management.",
    "Blocks are parts of one Halton sequence, and those of all schemes have the same starts: what "
    "is there after some blocks is an even picture of the whole.",
)


def cases(form: Form) -> Iterator[Case]:
    """Blocks of starts, each under every scheme before the next one."""
    blocks = QUICK_BLOCKS if form.quick else BLOCKS
    points = QUICK_POINTS if form.quick else POINTS
    for block in range(blocks):
        for scheme in SCHEMES:
            yield Case(
                name=f"{scheme}, block {block}",
                keys={"scheme": scheme, "block": block},
                task=BasinTask(scheme, block * points),
                items=points,
            )


def parameters(form: Form) -> Mapping[str, Any]:
    """What all loops have in common."""
    setup = basin_setup(SCHEMES[0])
    return {
        "robot": ROBOT, "settings": SETTINGS, "step_s": setup.scenario.integration.max_step,
        "bounds": setup.bounds.as_dict(), "box_m": setup.box, "tilt_deg": TILT_DEG,
        "yaw_deg": YAW_DEG, "seed": SEED, "options": OPTIONS, "way_poses": WAY_POSES,
        "case": setup.case, "statics": setup.statics,
        "scenarios": {scheme: basin_setup(scheme).scenario for scheme in SCHEMES},
    }  # fmt: skip


def numbers(runs: Runs) -> Mapping[str, Any]:
    """Counts by scheme, and how large the basin is beside each verdict's region."""
    names = ("points", "held", "seen", "runs", *ENDS, *VERDICTS)
    found: dict[str, Any] = {}
    for scheme, some in runs.by("scheme"):
        counts: dict[str, Any] = {name: some.total(name) for name in names}
        counts |= {
            "certified_not_converged": failed(some),
            **{f"converged_per_{name}": _ratio(some, name) for name in VERDICTS},
        }
        found[scheme] = counts
    return {"schemes": found}


def _ratio(runs: Runs, verdict: str) -> float | None:
    stable = runs.total(verdict)
    return runs.total(CONVERGED) / stable if stable else None


def _percent(name: str, of: str = "runs") -> Any:
    def words(runs: Runs) -> str:
        whole = runs.total(of)
        return f"{100.0 * runs.total(name) / whole:.1f}" if whole else "-"

    return words


def _certified_failures(runs: Runs) -> str:
    return ", ".join(f"{count} {end}" for end, count in failed(runs).items()) or "none"


def _larger(runs: Runs) -> str:
    ratio = _ratio(runs, CERTIFIED)
    return "-" if ratio is None else f"{ratio:.2f}"


STUDY = Study(
    name="basin",
    title="Where visual servoing converges from, beside the certified stability workspace",
    source="this project; criterion and bounds of the servoing thesis, 3.3",
    cases=cases,
    reduce=reduce,
    chunk=CHUNK,
    unit="starts",
    before="searching an integration step",
    parameters=parameters,
    numbers=numbers,
    assumptions=ASSUMPTIONS,
    checks=CHECKS,
    tables=[
        Summary(
            f"{ROBOT}: starts, and loops from those that are held and see the tag",
            ("scheme",),
            {
                "starts": Cell("total", "points"),
                "held": Cell("total", "held"),
                "and seen: loops": Cell("total", "runs"),
                "converged [%]": _percent(CONVERGED),
                "sampled [%]": _percent("sampled"),
                "searched [%]": _percent("searched"),
                "certified [%]": _percent(CERTIFIED),
                "basin / certified": _larger,
                "certified, not converged": _certified_failures,
            },
        ),
        Summary(
            "How loops end",
            ("scheme",),
            {end: Cell("total", end) for end in ENDS},
        ),
    ],
    figures=FIGURES,
)
