"""The same log with the loop closed from outside as inside, byte for byte."""

import numpy as np
import pytest

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.control.task_space import tracking_wrench_at
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.tensions.control_step_kernel import update_tensions_at
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, write_motion
from tests.sections.remote.served import assert_same_log, driven, scenario

ENGINES = ("compiled", "plant")


def own_control(settings):
    """Controller, distributor and trajectory as a client has them for itself, by place."""
    from cdpr_drake.models.robot_loader import load_robot

    control = build_tension_control(
        load_robot(settings.robot),
        TensionControlSettings(
            trajectory=settings.trajectory.trajectory(),
            gains=settings.controller.gains(),
            method=settings.distribution.method,
            limits=settings.limits(),
        ),
    )
    law, distribution = control.blocks.controller.packed(), control.blocks.distributor.packed()
    tensions, wrench, verdict = distribution.bounds[0].copy(), np.zeros(6), np.zeros(2)

    def controller(now):
        state = now.outputs["platform_state"].copy()  # kernels are compiled for writable arrays
        tracking_wrench_at(law.table, now.time, state, wrench)
        return {"desired_wrench": wrench}

    def distributor(now):
        state, asked = (now.outputs[name].copy() for name in ("platform_state", "desired_wrench"))
        update_tensions_at(distribution.table, state, asked, tensions, verdict)
        return {"tensions": tensions}

    def trajectory(now):
        motion = np.empty(MOTION_SIZE)
        write_motion(now.time, control.trajectory.stretches(), motion)
        return {"desired_motion": motion}

    return {"controller": controller, "distributor": distributor, "trajectory": trajectory}


@pytest.fixture(scope="module")
def inside():
    runs = {}
    for engine in ENGINES:
        runs[engine] = TensionRun(scenario(f"integration.engine={engine}")).simulate()
    return runs


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("place", ["controller", "distributor", "trajectory"])
def test_tension_control(inside, engine, place):
    settings = scenario(f"integration.engine={engine}", f"remote.place={place}")
    codec = "json" if engine == "plant" else "msgpack"
    law, seen = own_control(settings)[place], []

    def control(now):
        seen.append(set(now.outputs))
        return law(now)

    needed = {"distributor": ["desired_wrench", "platform_state"]}.get(place)
    run, end = driven(settings, control, codec, needed)
    assert needed is None or seen[0] == set(needed)
    assert end == {"outcome": "completed", "message": "", "sim_time_s": 0.05}
    assert run.outcome == Outcome.COMPLETED
    assert run.loop == ("diagram" if engine == "plant" else "remote")
    assert_same_log(run, inside[engine])
    report = run.as_dict()["remote"]
    assert report["exchanges"] == (50 if place == "distributor" else 51)  # and the log's last row
    assert report["codec"] == codec
    method = "client" if place == "distributor" else "barycenter"
    assert run.subtitle().startswith(f"tensions by the {method}, ")


def test_rows_of_the_log_between_control_steps():
    """They need a wrench of their own; the diagram and the loop ask for it at the same times."""
    rates = ("log_rate=300", "remote.place=controller")
    runs = []
    for how in ("integration.engine=compiled", None):
        settings = scenario("integration.engine=compiled", *rates)
        law = own_control(settings)["controller"]
        look = None if how else (lambda *_: None)
        runs.append(driven(settings, law, prepare=look)[0])
    alone = TensionRun(scenario("integration.engine=compiled", "log_rate=300")).simulate()
    assert [run.loop for run in runs] == ["remote", "diagram"]
    for run in runs:
        assert_same_log(run, alone)


def servo_scenario(*overrides):
    return scenario(
        "camera.kind=projected", "duration=0.3", *overrides, name="acrobot_pbvs"
    )  # fmt: skip


@pytest.mark.parametrize("place", ["servo", "twist"])
def test_visual_servo(place):
    settings = servo_scenario(f"remote.place={place}")
    law = build_visual_servo(servo_scenario()).servo
    memory = [law.controller.fresh_memory()]

    def control(now):
        def read(name):
            return pose_from_row(now.outputs[name]) if "X_" in name else now.outputs[name]

        names = ["platform_velocity"] + ["cable_velocities"] * (place == "servo")
        if read("found")[0] == 0.0:
            return {name: np.zeros(8 if "cable" in name else 6) for name in names}
        decided, memory[0] = law.decide(read, memory[0], now.time)
        return {name: decided[name] for name in names}

    run, _ = driven(settings, control)
    alone = ServoRun(servo_scenario()).simulate()
    assert list(run.log) == list(alone.log)
    for name in run.log:  # a pose that went through a quaternion has lost its last bits
        np.testing.assert_allclose(run.log[name], alone.log[name], rtol=0.0, atol=1e-9)
    assert np.max(np.abs(run.log["cable_velocities"])) > 1e-3


def test_a_place_needs_somebody():
    with pytest.raises(ScenarioError, match="cdpr serve"):
        TensionRun(scenario("remote.place=controller")).simulate()
    with pytest.raises(ScenarioError, match=r"remote\.place.*servo, twist"):
        servo_scenario("remote.place=controller")
