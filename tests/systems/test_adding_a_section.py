"""Sections of scenarios: one by a subclass, as CONTRIBUTING.md says, and one of another package."""

import logging
from dataclasses import replace
from types import SimpleNamespace
from typing import Annotated, ClassVar

import pytest
from pydrake.systems.framework import LeafSystem

from cdpr_drake.analyses.runs.run import Subject
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.schema.declarations import In, filled, settings
from cdpr_drake.systems import sections
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.loops.loop_choice import diagram_reason
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sections import Section, sections_at

QUICK = ["camera.kind=projected", "duration=0.2"]

SUBJECTS = (Subject("counter", lambda run: {"last": float(run.log["count"][-1, 0])}),)


@settings
class Counter(Section):
    """Counts, at its own rate: a toy of a section that brings a block."""

    words = "A counter"
    columns: ClassVar = {"count": ("counts",)}
    report = f"{__name__}:SUBJECTS"

    rate: Annotated[float, In("Hz", gt=0.0), "Counts per second."] = 10.0

    def refusals(self, scope):
        """A counter that is slower than the servo."""
        if self.rate < scope.whole.controller.rate:
            yield "rate", f"{self.rate:g}", f"at least {scope.whole.controller.rate:g} [Hz]"
        if scope.whole.seed == 13:
            yield "/seed", "13 beside a counter", "another"

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


@settings
class Twice(Counter):
    """Logs what a counter does, and needs the plant."""

    def add_to(self, builder, blocks, settings):
        """Adds nothing."""
        return {"count": blocks.servo.GetOutputPort("gain")}

    def needs_plant(self, scenario):
        """Always."""
        return True


@settings
class CountedTwice(CountedScenario):
    """A scenario with two sections that log under one name."""

    twice: Annotated[Twice, "Another counter."] = filled(Twice)


def load(*overrides):
    return load_scenario("acrobot_pbvs", [*QUICK, *overrides], schema=CountedScenario)


def test_a_section_adds_its_block_columns_and_numbers():
    run = ServoRun(load("counter.rate=100")).simulate()
    assert run.built.diagram.HasSubsystemNamed("counter")
    assert run.columns()["count.counts"][-1] == 20.0
    assert run.as_dict()["counter"] == {"last": 20.0}
    assert "section counter adds blocks" in diagram_reason(run.scenario)


def test_a_section_refuses_by_its_own_key_and_by_others():
    with pytest.raises(ScenarioError, match=r"counter\.rate: found 10; accepted: at least") as info:
        load("seed=13")
    assert "seed: found 13 beside a counter" in str(info.value)
    with pytest.raises(ScenarioError, match="counter"):
        load_scenario("acrobot_pbvs", [*QUICK, "counter.rate=100"])


def test_two_sections_do_not_log_under_one_name_and_the_plant_is_asked_for():
    scenario = load_scenario(
        "acrobot_pbvs", [*QUICK, "counter.rate=100", "twice.rate=100"], schema=CountedTwice
    )
    with pytest.raises(ScenarioError, match="twice: logs count, as another section does"):
        build_visual_servo(scenario)
    compiled = replace(scenario, integration=replace(scenario.integration, engine="compiled"))
    with pytest.raises(ScenarioError, match=r"integration\.engine: found compiled beside twice"):
        build_visual_servo(compiled)


def entries(**targets):
    return lambda group: [SimpleNamespace(name=f"visual_servo.{name}", value=target)
                          for name, target in targets.items()]  # fmt: skip


def test_a_section_of_another_package_gets_a_key(monkeypatch):
    monkeypatch.setattr(sections, "entry_points", entries(counter=f"{__name__}:Counter"))
    assert sections_at("visual_servo")["counter"] is Counter
    assert "counter" not in sections_at("camera")


@pytest.mark.parametrize("target", ["no.such.package:Counter", f"{__name__}:Missing"])
def test_one_that_cannot_be_imported_is_left_out_with_a_warning(monkeypatch, caplog, target):
    monkeypatch.setattr(sections, "entry_points", entries(counter=target))
    with caplog.at_level(logging.WARNING):
        assert "counter" not in sections_at("visual_servo")
    assert f"visual_servo.counter = {target}: left out" in caplog.text


def test_a_key_that_is_taken_stays_what_it_is(monkeypatch, caplog):
    monkeypatch.setattr(sections, "entry_points", entries(rate=f"{__name__}:Counter"))

    class Servo:
        rate: float = 1.0

    with caplog.at_level(logging.WARNING):
        sections.with_sections("visual_servo")(Servo)
    monkeypatch.setattr(sections, "entry_points", entries(stability=f"{__name__}:Counter"))
    with caplog.at_level(logging.WARNING):
        assert sections_at("visual_servo")["stability"] is not Counter
    assert "visual_servo.stability" in caplog.text
    assert Servo.rate == 1.0
    assert "visual_servo.rate: left out: the key is taken" in caplog.text
