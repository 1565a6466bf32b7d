"""A section of a scenario, as CONTRIBUTING.md says; other toys are in tests/recipes."""

from typing import Annotated, ClassVar

import pytest
from pydrake.systems.framework import LeafSystem

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.schema.declarations import In, filled, settings
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sections import Section

QUICK = ["camera.kind=projected", "duration=0.2"]


@settings
class Counter(Section):
    """Counts, at its own rate: a toy of a section that brings a block."""

    words = "A counter"
    columns: ClassVar = {"count": ("counts",)}

    rate: Annotated[float, In("Hz", gt=0.0), "Counts per second."] = 10.0

    def add_to(self, builder, blocks, settings):
        """Adds the block beside the servo."""

        class Count(LeafSystem):
            def __init__(self, rate):
                super().__init__()
                state = self.DeclareDiscreteState(1)
                self.DeclarePeriodicDiscreteUpdateEvent(
                    1.0 / rate,
                    0.0,
                    lambda context, after: after.set_value(
                        state, context.get_discrete_state(state).value() + 1.0
                    ),
                )
                self.DeclareStateOutputPort("count", state)

        counter = builder.AddNamedSystem("counter", Count(self.rate))
        return {"count": counter.GetOutputPort("count")}


@settings
class CountedScenario(Scenario):
    """A scenario with one section more."""

    counter: Annotated[Counter, "A counter."] = filled(Counter)


def test_a_scenario_section():
    overrides = [*QUICK, "counter.rate=100"]
    result = ServoRun(load_scenario("acrobot_pbvs", overrides, schema=CountedScenario)).simulate()
    counter = result.built.diagram.GetSubsystemByName("counter")
    assert result.built.scenario.counter.rate == 100.0
    assert counter.GetOutputPort("count").size() == 1
    assert result.columns()["count.counts"][-1] == 20.0
    with pytest.raises(ScenarioError, match="counter"):
        load_scenario("acrobot_pbvs", overrides)
