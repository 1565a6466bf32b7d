"""Dynamic control as one compiled loop: the numbers of the diagram, at the same instants."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_control import (
    TensionControlSettings,
    build_tension_control,
)
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import DampingSettings

SAME = 1e-13
"""Of largest numbers: the same kernels in the same order, compiled together and apart."""

END = 0.23
"""Simulated time, between two control steps of most rates [s]."""


def control(name, *, rate=1000.0, log_rate=100.0, max_step=1e-3, method=None, **more):
    scenario = load_scenario(name, ["trajectory.pause=0", "trajectory.stretches="
        "[{pose: {position: [0.05, 0.02, 0.3]}, duration: 0.3}]",
        "trajectory.start={position: [0.0, 0.0, 0.25]}"])  # fmt: skip
    settings = TensionControlSettings(
        trajectory=scenario.trajectory.trajectory(),
        gains=scenario.controller.gains(),
        method=method or scenario.distribution.method,
        limits=scenario.limits(),
        rate=rate,
        rule=StepRule(max_step=max_step),
        **more,
    )
    return build_tension_control(load_robot(scenario.robot), settings, log_rate=log_rate)


def by_diagram(built, pieces):
    simulator = Simulator(built.diagram, built.make_context())
    simulator.Initialize()
    for time in pieces:
        simulator.AdvanceTo(time)
    context = simulator.get_context()
    return built.read_log(context), built.motion.state(built.motion.GetMyContextFromRoot(context))


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("acrobot_computed_torque", {}),
        ("acrobot_computed_torque", {"rate": 700.0, "log_rate": 330.0, "max_step": 4e-4}),
        ("acrobot_computed_torque", {"damping": DampingSettings(translation=40.0, rotation=0.5)}),
        # Requests that are not met, which are held and counted.
        ("acrobot_computed_torque", {"rate": 90.0, "log_rate": 1000.0, "method": "dykstra"}),
    ],
)
def test_the_loop_is_the_diagram_without_its_callbacks(name, options):
    built = control(name, **options)
    assert can_be_compiled(built)
    pieces = [0.1, 0.2, END]
    log, state = by_diagram(built, pieces)
    loop = TensionLoop(built, options.get("log_rate", 100.0))
    for time in pieces:
        loop.advance_to(time)
    assert loop.time == END
    compiled = loop.read_log()
    assert set(compiled) == set(log)
    assert len(log["time"]) > 20
    for key, values in log.items():
        assert compiled[key].shape == values.shape, key
        np.testing.assert_allclose(
            compiled[key], values, rtol=0.0, atol=SAME * (1.0 + np.max(np.abs(values)))
        )
    np.testing.assert_allclose(loop.state(), state, rtol=0.0, atol=SAME)
    assert np.ptp(log["X_WP"][:, 6]) > 0.005  # it moves


def test_a_log_is_read_in_pieces_and_one_call_is_many():
    built = control("acrobot_computed_torque")
    whole, pieces = TensionLoop(built, 100.0), TensionLoop(built, 100.0)
    whole.advance_to(END)
    read = []
    for time in (0.05, 0.15, END):
        pieces.advance_to(time)
        read.append(pieces.read_log())
        assert pieces.rows() == len(read[-1]["time"])
        pieces.clear()
    for key, values in whole.read_log().items():
        joined = np.concatenate([piece[key] for piece in read])
        # Where a call ends, a step of the integrator ends.
        np.testing.assert_allclose(joined, values, rtol=1e-9, atol=1e-9)
    assert pieces.errors() == pytest.approx(whole.errors(), abs=1e-9)


def test_a_loop_starts_where_it_is_told():
    built = control("acrobot_computed_torque")
    start = built.trajectory.pose(0.0)
    start.set_translation(start.translation() + np.array([0.01, -0.02, 0.0]))
    loop = TensionLoop(built, 100.0, start)
    assert loop.errors()[0] == pytest.approx(np.hypot(0.01, 0.02))
    loop.advance_to(0.05)
    columns, log = loop.columns(), loop.read_log()
    np.testing.assert_array_equal(columns["tensions"], log["tensions"])
    np.testing.assert_allclose(log["X_WP"][0, 4:], start.translation(), atol=SAME)


def test_what_is_no_loop_of_kernels_is_refused():
    class Own(TensionDistributor):
        pass

    built = control("acrobot_computed_torque", distributor=Own)
    assert not can_be_compiled(built)
    with pytest.raises(CdprError, match="acrobot_large: found a plant, a distributor"):
        TensionLoop(built, 100.0)
