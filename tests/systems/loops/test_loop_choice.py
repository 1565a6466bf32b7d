"""Which runs a loop does, and what is said of those that it cannot do."""

import pytest
from pydrake.common.value import Value
from pydrake.systems.framework import LeafSystem

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS, EstimatorKind
from cdpr_drake.systems.loops.loop_choice import (
    choose_compiled_loop,
    diagram_reason,
    set_loop,
    uses_compiled_loop,
)
from cdpr_drake.systems.loops.servo_loop import ServoLoop

PROJECTED = "camera.kind=projected"


def test_repeated_runs_take_the_loop_and_say_so():
    short = load_scenario("acrobot_pbvs", [PROJECTED])
    assert set_loop(short) == (short, "")
    scenario, words = set_loop(short, repeated=True)
    assert uses_compiled_loop(scenario)
    assert scenario.integration.engine == "compiled"
    assert words == (
        "acrobot_pbvs: by the compiled loop, as the run is repeated; else "
        "with overrides integration.loop=diagram"
    )


def test_a_long_run_takes_the_loop_unless_somebody_watches():
    long = load_scenario("acrobot_mobile_robot")
    chosen, words = set_loop(long)
    assert uses_compiled_loop(chosen)
    assert words == (
        "acrobot_mobile_robot: by the compiled loop, as it lasts longer than 600 s; else "
        "with overrides integration.loop=diagram"
    )
    shown, words = set_loop(long, watched=True)
    assert not uses_compiled_loop(shown)
    assert "by the compiled engine" in words
    assert "in a diagram, as a viewer looks into one" in words
    asked = load_scenario("acrobot_mobile_robot", ["integration.loop=diagram"])
    assert not uses_compiled_loop(set_loop(asked)[0])


@pytest.mark.parametrize(
    ("overrides", "reason"),
    [
        (["camera.kind=rendered"], "its camera is rendered"),
        ([PROJECTED, "winches={kind: motor, mode: position}"], "commanded by position"),
    ],
)
def test_what_only_a_diagram_can_do_is_said(overrides, reason):
    scenario = load_scenario("acrobot_friction", overrides)
    assert reason in diagram_reason(scenario)
    chosen, words = set_loop(scenario, repeated=True)
    assert not uses_compiled_loop(chosen)
    assert chosen.integration.engine == "compiled"
    assert f"in a diagram, as its {reason.removeprefix('its ')}" in words or reason in words
    asked = load_scenario("acrobot_friction", [*overrides, "integration.loop=compiled"])
    for refuse in (set_loop, ServoRun):
        with pytest.raises(ScenarioError, match=r"integration\.loop: found compiled, but its"):
            refuse(asked)


@pytest.mark.parametrize("choice", ["integration.engine=plant", "integration.loop=diagram"])
def test_what_is_asked_for_is_left(choice):
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, choice])
    chosen, words = set_loop(scenario, repeated=True)
    assert not uses_compiled_loop(chosen)
    assert (words == "") == ("plant" in choice)
    assert not uses_compiled_loop(choose_compiled_loop(scenario))


def test_dynamic_control_has_no_servo_loop():
    scenario = load_scenario("acrobot_computed_torque")
    assert diagram_reason(scenario) == "it is no visual servo"
    assert not uses_compiled_loop(set_loop(scenario, repeated=True)[0])


def test_a_block_of_a_user_s_is_left_to_the_diagram(monkeypatch):
    class Stuck(LeafSystem):
        def __init__(self, X_WP0):
            super().__init__()
            self.DeclareAbstractOutputPort(
                "X_WP", lambda: Value(X_WP0), lambda _, output: output.set_value(X_WP0)
            )

    kind = EstimatorKind("stuck", lambda task: Stuck(task.robot.X_WP0))
    monkeypatch.setitem(ESTIMATORS, "stuck", kind)
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, "estimator.kind=stuck"])
    assert "estimator stuck is a block" in diagram_reason(scenario)
    assert not uses_compiled_loop(set_loop(scenario, repeated=True)[0])
    with pytest.raises(ScenarioError, match="only a diagram can step"):
        ServoLoop(scenario)


def test_the_summary_names_the_loop():
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, "duration=0.1"])
    assert ServoRun(choose_compiled_loop(scenario)).simulate().as_dict()["loop"] == "compiled"
    summary = ServoRun(scenario).simulate().as_dict()
    assert (summary["engine"], summary["loop"]) == ("plant", "diagram")
