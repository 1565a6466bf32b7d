"""Study: both engines on every scenario, on robots that are drawn, and on impacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cdpr_drake.analyses.studies.engines.figures import engine_figure
from cdpr_drake.analyses.studies.engines.pairs import (
    ENERGY_DURATION,
    ENERGY_STEPS,
    IMPACTS,
    METHODS,
    ORDERS,
    energy_row,
    run_pair,
    slack_override,
    taut_row,
)
from cdpr_drake.analyses.studies.engines.statements import CHECKS
from cdpr_drake.analyses.studies.framework.runs import Row
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import (
    TENSION_CONTROL,
    robot_scenario_names,
    scenario_kind,
)
from cdpr_drake.systems.scenarios.run_settings import has_contact

RUNS, QUICK_RUNS = 200, 2
"""Servos with impacts, full and quick."""

LONGEST = 120.0
"""Simulated time after which scenarios of hours are compared [s]."""

MOTIONS, QUICK_MOTIONS = 30, 3
"""Robots that are drawn for taut motions."""

QUICK_SCENARIOS = ("acrobot_pbvs", "planar_computed_torque", "planar_pbvs")
QUICK_DURATION = 0.5
"""Scenarios of the quick form, and how long they run [s]."""

QUICK_ENERGY = 0.5
"""How long the undamped robot bounces in the quick form [s]."""


def cases(form: Form) -> Iterator[Case]:
    """Scenarios, taut motions and impacts over seeds, orders by what cables do, steps."""
    for name in QUICK_SCENARIOS if form.quick else robot_scenario_names():
        scenario = load_scenario(name)
        if has_contact(scenario):
            continue  # one engine only has contact: there is nothing to compare
        changes = (f"duration={LONGEST}",) if scenario.duration > LONGEST else ()
        if form.quick and scenario_kind(name) != TENSION_CONTROL:
            changes = (f"duration={QUICK_DURATION}",)
        keys = {"kind": "scenario", "scenario": name}
        yield Case(name=f"scenario {name}", keys=keys, changes=changes, most=1)
    yield Case(name="taut motions", keys={"kind": "taut"}, seeds=MOTIONS)
    for name, trial in ORDERS.items():
        yield Case(name=f"order {name}", keys={"kind": "order", "order": name}, data=trial, most=1)
    for step in ENERGY_STEPS:
        yield Case(
            name=f"energy {step:g} s",
            keys={"kind": "energy", "step_s": step},
            data=QUICK_ENERGY if form.quick else ENERGY_DURATION,
            most=1,
        )
    few = form.quick and form.asked_seeds is None
    yield Case(name="impacts", keys={"kind": "impacts"}, most=QUICK_RUNS if few else None)


def measure(case: Case, seed: int) -> Row:
    """A row of `run_pair`, `taut_row`, `OrderTrial` or `energy_row`."""
    kind = case.keys["kind"]
    if kind == "taut":
        return taut_row(seed)
    if kind == "order":
        row: Row = case.data.row()
        return row
    if kind == "energy":
        return energy_row(case.keys["step_s"], case.data)
    if kind == "impacts":
        return run_pair(IMPACTS, [slack_override(seed), f"seed={seed}"])
    return run_pair(case.keys["scenario"], case.changes)


def parameters(form: Form) -> Mapping[str, Any]:
    """What is compared."""
    return {"methods": METHODS, "energy_steps_s": ENERGY_STEPS, "impacts": IMPACTS}


STUDY = Study(
    name="engines",
    title="The plant and the compiled engine beside each other",
    cases=cases,
    measure=measure,
    seeds=(RUNS, QUICK_MOTIONS),
    parameters=parameters,
    stated="What the engines have to show",
    checks=CHECKS,
    tables=[
        Summary(
            "Scenarios by both engines",
            ("scenario", "outcome_plant", "outcome_compiled"),
            {
                "plant ends at [s]": Cell("mean", "time_plant_s", ".2f"),
                "compiled [s]": Cell("mean", "time_compiled_s", ".2f"),
                "path [um]": Cell("largest", "distance_m", ".3g"),
                "end [um]": Cell("largest", "final_distance_m", ".3g"),
                "error of plant [um]": Cell("largest", "final_error_plant_m", ".4g"),
                "of compiled [um]": Cell("largest", "final_error_compiled_m", ".4g"),
                "slack": Cell("mean", "slack_share", ".2f"),
            },
            where={"kind": "scenario"},
        )
    ],
    figures={"engines": engine_figure},
)
