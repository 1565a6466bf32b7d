"""Whole runs by the compiled engine: as the plant runs them, and said so."""

import numpy as np
import pytest

from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.run_settings import engine_of

COMPILED = "integration.engine=compiled"
PROJECTED = "camera.kind=projected"

SAME_PATH = 1e-6
"""Distance of paths in which cables go slack and catch [m]; the engines take steps of
the same length, but not at the same times."""

SAME_TENSIONS_PATH = 1e-12
"""The same without cables that stretch, where nothing is stiff."""


def by_both(run, name, *overrides):
    """A run by the plant, one by the compiled engine, and how far apart their paths are [m]."""
    one, other = (
        run(load_scenario(name, [*overrides, engine])).simulate()
        for engine in ("integration.engine=plant", COMPILED)
    )
    count = min(len(one.log["time"]), len(other.log["time"]))
    apart, _ = pose_rows_distance(one.log["X_WP"][:count], other.log["X_WP"][:count])
    return one, other, np.max(apart)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [("acrobot_pbvs", ()), ("acrobot_friction", ("winches.mode=position",)), ("planar_pbvs", ())],
)
def test_a_servo_takes_the_same_path(name, overrides):
    plant, compiled, apart = by_both(ServoRun, name, PROJECTED, "duration=0.6", *overrides)
    assert plant.outcome == compiled.outcome == Outcome.TIMEOUT
    assert np.max(np.ptp(plant.log["X_WP"][:, 4:], axis=0)) > 0.01
    assert apart < SAME_PATH
    np.testing.assert_allclose(plant.log["time"], compiled.log["time"], atol=1e-9)


def test_the_summary_names_engine_and_errors_and_a_run_repeats_byte_for_byte():
    scenario = load_scenario("acrobot_pbvs", [PROJECTED, COMPILED, "duration=0.3"])
    first, again = ServoRun(scenario).simulate(), ServoRun(scenario).simulate()
    for name, values in first.log.items():
        assert values.tobytes() == again.log[name].tobytes()
    summary = first.as_dict()
    assert summary["engine"] == "compiled"
    assert 0.0 < summary["step_error"]["m"] < 1e-4
    plant = ServoRun(load_scenario("acrobot_pbvs", [PROJECTED, "duration=0.1"])).simulate()
    assert plant.as_dict()["engine"] == "plant"
    assert plant.as_dict()["step_error"] is None


def test_a_rendered_camera_sees_the_platform_where_the_engine_has_it():
    _, compiled, apart = by_both(ServoRun, "acrobot_pbvs", "camera.kind=rendered", "duration=0.2")
    assert compiled.log["found"][-1, 0] == 1.0
    assert apart < SAME_PATH


def test_accuracy_and_the_semi_implicit_method_can_be_asked_for():
    short = (PROJECTED, COMPILED, "duration=0.3")
    careful, stable = (
        ServoRun(load_scenario("acrobot_pbvs", [*short, *more])).simulate()
        for more in (["integration.accuracy=1e-8"],
                     ["integration.integrator=semi_implicit", "integration.max_step=0.01"])
    )  # fmt: skip
    assert np.all(careful.step_errors <= 1e-8)
    apart, _ = pose_rows_distance(careful.log["X_WP"], stable.log["X_WP"])
    assert np.max(apart) < 1e-3


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["integration.integrator=semi_implicit"], "found semi_implicit with the engine plant"),
        (["integration.accuracy=1e-9"], "accuracy: found 1e-09 with the engine plant"),
        (["integration.engine=mujoco"], "engine: found mujoco; accepted: one of automatic"),
    ],
)
def test_what_an_engine_cannot_do_is_refused(overrides, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("acrobot_pbvs", overrides)


def test_a_run_that_diverges_says_so():
    overrides = [PROJECTED, COMPILED, "integration.max_step=0.2", "duration=5"]
    result = ServoRun(load_scenario("acrobot_pbvs", overrides)).simulate()
    assert result.outcome == Outcome.DIVERGED
    assert "not finite" in result.message
    assert result.as_dict()["step_error"] is None


def test_cables_that_break_are_found(tmp_path):
    text = robot_file("acrobot_small").read_text()
    path = tmp_path / "acrobot_small.yaml"
    path.write_text(text.replace("cable:\n", "cable:\n  breaking_load: 4\n"))
    overrides = [PROJECTED, COMPILED, "duration=0.4", f"robot={path}", "stop.broken_cable=true"]
    result = ServoRun(load_scenario("acrobot_pbvs", overrides)).simulate()
    assert result.outcome == Outcome.CABLE_BROKEN
    assert np.any(result.broken > 0.0)


def test_the_plant_is_what_nobody_asked_otherwise():
    servo = build_visual_servo(load_scenario("acrobot_pbvs", [PROJECTED]))
    assert servo.scenario.integration.engine == "automatic"
    assert engine_of(servo.scenario) == "plant"
    assert servo.cable_robot.HasSubsystemNamed("plant")


def test_commanded_tensions_lead_the_platform_the_same_way():
    plant, compiled, apart = by_both(TensionRun, "acrobot_computed_torque", "duration=0.6")
    assert apart < SAME_TENSIONS_PATH
    np.testing.assert_allclose(plant.log["lengths"], compiled.log["lengths"], atol=1e-12)
    assert compiled.as_dict()["engine"] == "compiled"


def test_commanded_tensions_run_as_one_compiled_loop_with_the_numbers_of_the_diagram(tmp_path):
    scenario = load_scenario("planar_computed_torque", ["duration=0.35", COMPILED])
    loop = TensionRun(scenario).simulate(tmp_path)
    seen = []
    follow = Follow(prepare=lambda run, simulator, built: seen.append(built))
    diagram = TensionRun(scenario).simulate(follow=follow)
    assert seen[0] is diagram.built.diagram
    assert loop.outcome == diagram.outcome == Outcome.COMPLETED
    assert loop.sim_time == diagram.sim_time == 0.35
    for name, values in diagram.log.items():
        np.testing.assert_allclose(loop.log[name], values, rtol=0.0, atol=1e-9)
    one, other = (run.as_dict() for run in (loop, diagram))
    assert (one["loop"], other["loop"]) == ("compiled", "diagram")
    assert one["position_error_m"]["max"] == pytest.approx(other["position_error_m"]["max"])


def test_a_compiled_loop_that_leaves_the_frame_ends_as_the_diagram_does():
    overrides = ["duration=8.0", COMPILED, "controller.rate=6"]
    scenario = load_scenario("acrobot_computed_torque", overrides)
    loop = TensionRun(scenario).simulate()
    diagram = TensionRun(scenario).simulate(follow=Follow(prepare=lambda *_: None))
    assert loop.outcome == diagram.outcome == Outcome.DIVERGED
    assert loop.sim_time == pytest.approx(diagram.sim_time)
    assert loop.message == diagram.message
