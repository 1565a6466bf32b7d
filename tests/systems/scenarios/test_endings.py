"""Every shipped scenario ends as its file says, and does what its title names.

Targets are projected where they can be, and long runs are cut. With CDPR_WHOLE_SCENARIOS=1 all run
as they ship, rendered and to their end, which takes hours.
"""

import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cdpr_drake.analyses.runs.simulate import KINDS
from cdpr_drake.errors import CdprError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop, set_loop, uses_compiled_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from tests.systems.scenarios.scenario_titles import CHECKS, SHORTER

WHOLE = "CDPR_WHOLE_SCENARIOS" in os.environ

LONGEST_LOOP, LONGEST_DIAGRAM = 100.0, 1.0
"""Simulated time at most, by the compiled loop and by a diagram [s]."""

LASTING = ("timeout", "completed")
"""Outcomes of runs that last as long as they may."""


def projected(name):
    """The change that projects a scenario's target; none if it cannot be projected."""
    change = ["camera.kind=projected"]
    try:
        load_scenario(name, change)
    except CdprError:
        return []
    return change


def shortened(name, items):
    """A scenario with a projected target and changes that make it short, or cut after a time."""
    scenario = load_scenario(name, [*projected(name), *items])
    if isinstance(scenario, Scenario):
        scenario = choose_compiled_loop(scenario)
    else:
        scenario = set_loop(scenario, repeated=True)[0]
    if items and not uses_compiled_loop(scenario):
        return scenario
    longest = LONGEST_LOOP if uses_compiled_loop(scenario) else LONGEST_DIAGRAM
    return replace(scenario, duration=min(scenario.duration, longest))


@pytest.mark.parametrize("name", scenario_names())
def test_a_scenario_ends_as_its_file_says_and_does_what_its_title_names(name, tmp_path):
    items = SHORTER.get(name, ())
    shipped = load_scenario(name)
    kind, expected = KINDS[shipped.kind], shipped.expected
    assert expected is not None
    if WHOLE:
        scenario = set_loop(shipped)[0]
        kind(scenario).check()
    else:
        scenario = shortened(name, items)
        kind(shortened(name, ())).check()
    result = kind(scenario).simulate(tmp_path)
    outcome = Outcome(result.outcome).name.lower()
    if scenario.duration >= shipped.duration or outcome not in LASTING:
        assert outcome == expected.outcome, result.message
        distance, angle = result.end_error()
        assert expected.position is None or distance <= expected.position
        assert expected.rotation_deg is None or np.degrees(angle) <= expected.rotation_deg
    run = SimpleNamespace(
        summary=result.as_dict(),
        log={key: np.array(rows) for key, rows in result.log.items()},
        end=result.end_error(),
        scheme=getattr(getattr(scenario, "controller", None), "scheme", None),
    )
    for check, names in () if WHOLE else CHECKS:
        assert name not in names.split() or check(run), (check.__name__, outcome)
    if isinstance(scenario, TensionScenario):
        low, high = scenario.limits()
        assert run.summary["infeasible_steps"] == 0
        assert low - 1e-9 <= run.summary["tension_n"]["min"]
        assert run.summary["tension_n"]["max"] <= high
