"""A toy of each kind, added through the public tables only: what CONTRIBUTING.md promises."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import LeafSystem

from cdpr_drake.analyses.reporting.log_files import write_log
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.schema.fields import number, section
from cdpr_drake.servoing.visual_features import ObjectPoseFeatures
from cdpr_drake.systems.cameras.targets import TARGETS
from cdpr_drake.systems.controllers.schemes import SCHEMES
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS, EstimatorKind
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS, SensorKind
from cdpr_drake.vision.apriltags import TagTarget

QUICK = ["camera.kind=projected", "duration=0.2"]


def test_an_estimator(monkeypatch):
    class Stuck(LeafSystem):
        """Believes that the platform rests where it was at the start."""

        def __init__(self, X_WP0):
            super().__init__()
            self.DeclareAbstractOutputPort(
                "X_WP", lambda: Value(X_WP0), lambda _, output: output.set_value(X_WP0)
            )

    kind = EstimatorKind("stuck", lambda task: Stuck(task.robot.X_WP0))
    monkeypatch.setitem(ESTIMATORS, "stuck", kind)
    result = run_scenario(load_scenario("acrobot_pbvs", [*QUICK, "estimator.kind=stuck"]))
    believed = result.log["X_WP_estimated"]
    np.testing.assert_array_equal(believed, np.tile(believed[0], (len(believed), 1)))


def test_an_unknown_name_is_refused_with_what_there_is(monkeypatch):
    monkeypatch.setitem(ESTIMATORS, "toy", ESTIMATORS["measured"])
    with pytest.raises(ScenarioError, match=r"estimator\.kind: found nothing.*toy"):
        load_scenario("acrobot_pbvs", ["estimator.kind=nothing"])


def test_a_scheme(monkeypatch):
    monkeypatch.setitem(SCHEMES, "toy", lambda settings, target, X_CdO: ObjectPoseFeatures(X_CdO))
    toy, pbvs = (
        run_scenario(load_scenario("acrobot_pbvs", [*QUICK, f"controller.scheme={scheme}"]))
        for scheme in ("toy", "pbvs")
    )
    np.testing.assert_array_equal(toy.log["X_WP"], pbvs.log["X_WP"])


def test_a_target(monkeypatch):
    monkeypatch.setitem(TARGETS, "big", lambda settings: TagTarget(7, 2.0 * settings.size))
    servo = build_visual_servo(load_scenario("acrobot_pbvs", [*QUICK, "target.kind=big"]))
    tag = TagTarget(0, 2.0 * servo.scenario.target.size)
    np.testing.assert_array_equal(servo.target.points, tag.points)


def test_a_sensor(monkeypatch, tmp_path):
    class Height(LeafSystem):
        """Reads the height of the platform."""

        def __init__(self, rate):
            super().__init__()
            self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
            self._state = self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
            self.DeclareStateOutputPort("height", self._state)

        def _update(self, context, state):
            state.set_value(self._state, self._X_WP.Eval(context).translation()[2:])

    @dataclass
    class Ultrasound:
        rate_hz: float = 50.0

    kind = SensorKind(
        reading="measured_height", truth="X_WP", block="altimeter", output="height",
        default="ultrasound", types=lambda: ("ultrasound",), load=lambda name: Ultrasound(),
        make=lambda model, robot, seed, rate: Height(rate),
    )  # fmt: skip
    monkeypatch.setitem(SENSORS, "altimeter", kind)
    log = run_scenario(load_scenario("acrobot_pbvs", [*QUICK, "sensors.log=[altimeter]"])).log
    heights = log["measured_height"][2:, 0]
    assert np.max(np.abs(heights - log["X_WP"][2:, 6])) < 5e-3
    write_log(tmp_path, log, [f"C{i}" for i in range(8)], ["feature"] * 6)
    assert "measured_height.0" in (tmp_path / "log.csv").read_text()


@dataclass(kw_only=True)
class Counter:
    """Counts, at its own rate: a toy of a section that brings a block."""

    rate: float = number("Counts per second.", "Hz", 10.0, above=0.0)

    def add_to(self, builder, blocks):
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

        builder.AddNamedSystem("counter", Count(self.rate))


@dataclass(kw_only=True)
class CountedScenario(Scenario):
    """A scenario with one section more."""

    counter: Counter = section("A counter.", Counter, required=False)


def test_a_scenario_section():
    overrides = [*QUICK, "counter.rate=100"]
    result = run_scenario(load_scenario("acrobot_pbvs", overrides, schema=CountedScenario))
    counter = result.servo.diagram.GetSubsystemByName("counter")
    assert result.servo.scenario.counter.rate == 100.0
    assert counter.GetOutputPort("count").size() == 1
    with pytest.raises(ScenarioError, match="counter"):
        load_scenario("acrobot_pbvs", overrides)
