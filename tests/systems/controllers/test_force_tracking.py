"""Laws that answer forces on a simulated robot: what they must show, measured."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import curve_fit

from cdpr_drake.analyses.simulation.tension_control_run import (
    run_tension_scenario,
    summarize_tension_run,
    tension_pictures,
)
from cdpr_drake.control.force_laws import port_energy
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.disturbances import DisturbanceSettings, Push
from cdpr_drake.systems.scenarios.run_settings import engine_of, set_engine

HELD, LED, WIND = "acrobot_table_edge", "acrobot_led_by_hand", "acrobot_against_wind"
MASS = 3.5


def run(name, *changes):
    return run_tension_scenario(load_scenario(name, changes))


def impedance(K, D):
    return (
        "force_control={kind: impedance, "
        f"stiffness: [20, 20, 20, {K}, {K}, {K}], damping: [1, 1, 1, {D}, {D}, {D}]}}"
    )


@pytest.mark.parametrize(("frequency", "ratio"), [(1.0, 0.3), (2.0, 0.2)])
def test_an_impedance_swings_as_its_formula_says(frequency, ratio):
    """omega = sqrt(K / m) and D / (2 sqrt(K m)), within 2 % while cables stay taut."""
    omega = 2.0 * np.pi * frequency
    K, D = MASS * omega**2, 2.0 * ratio * MASS * omega
    push = "disturbances={pushes: [{kind: push, start: 0.0, end: 0.2, force: [8.0, 0.0, 0.0]}]}"
    log = run(WIND, impedance(K, D), push, "duration=2.5", "log_rate=500").log
    assert np.min(log["tensions"][1:]) > 1.0 - 1e-9
    assert np.all(log["feasible"][1:] == 1.0)
    later = log["time"] > 0.25
    t, x = log["time"][later] - 0.25, log["X_WP"][later, 4]

    def swing(t, a, b, w, z):
        free = w * np.sqrt(1.0 - z**2)
        return np.exp(-z * w * t) * (a * np.cos(free * t) + b * np.sin(free * t))

    fit = curve_fit(swing, t, x, p0=(x[0], 0.0, 0.9 * omega, 0.1))[0]
    assert fit[2] == pytest.approx(omega, rel=0.02)
    assert fit[3] == pytest.approx(ratio, rel=0.02)


def test_an_impedance_gives_way_by_force_over_stiffness():
    push = "disturbances={pushes: [{kind: step, start: 0.0, force: [3.0, -2.0, 1.0]}]}"
    log = run(WIND, impedance(400.0, 60.0), push, "duration=1.5").log
    moved = log["X_WP"][-1, 4:] - log["X_WP_desired"][-1, 4:]
    np.testing.assert_allclose(moved, np.array([3.0, -2.0, 1.0]) / 400.0, rtol=1e-3)


@pytest.mark.parametrize("wrong", [0.7, 1.0, 1.3])
def test_a_force_of_5_n_is_held_on_a_table_of_another_stiffness(wrong):
    """Contact on two corners is half of m g / penetration, 17 kN/m."""
    true = 0.5 * MASS * 9.81 / 0.001
    result = run(
        HELD, f"force_control.contact_stiffness={wrong * true}", "trajectory.pause=1",
        "trajectory.stretches=[{pose: {position: [0.0955, 0.0, 0.2]}, duration: 2}]", "duration=3",
    )  # fmt: skip
    forces = summarize_tension_run(result)["forces"]
    assert forces["held_from_s"] < 1.0
    assert forces["held_rms_n"] < 0.3
    assert np.all(result.log["contact_force"][-100:, 0] > 4.0)
    assert result.log["X_WP"][-1, 5] == pytest.approx(0.0, abs=2e-3)  # along the edge it follows
    assert np.max(np.abs(result.log["X_WP"][:, 1:4])) < 0.01  # and turns by less than a degree
    assert np.min(result.log["cable_clearance"]) > 0.0  # the table is below the lower anchor points
    assert "forces.png" in tension_pictures(result, ("png",))


def test_what_is_led_by_hand_goes_where_it_is_led_and_stays():
    """Of a push F for a time T: F T / D, when it has come to rest."""
    log = run(LED, "duration=2.4").log
    np.testing.assert_allclose(log["X_WP"][-1, 4], 6.0 * 1.5 / 60.0, rtol=0.02)
    np.testing.assert_allclose(log["displacement"][-1, 3], log["X_WP"][-1, 4], atol=1e-3)


def test_an_observer_holds_against_wind():
    errors = {}
    for reject in ("true", "false"):
        log = run(WIND, f"force_control.reject={reject}", "duration=3").log
        away = np.linalg.norm(log["X_WP"][:, 4:] - log["X_WP_desired"][:, 4:], axis=1)
        errors[reject] = np.mean(away[100:])
    assert errors["true"] < 0.2 * errors["false"]


def test_an_observer_does_not_take_the_platform_s_damping_for_a_push():
    """Along 0.1 m in half a second 20 N s/m brake with 7.5 N."""
    way = (
        "trajectory={pause: 0.1, start: {position: [0, 0, 0.3]}, "
        "stretches: [{pose: {position: [0.1, 0, 0.3]}, duration: 0.5}]}"
    )
    log = run(
        WIND, "disturbances=null", way, "duration=0.7", "damping.translation=20",
        "log_rate=500",
    ).log  # fmt: skip
    assert np.all(log["feasible"][1:] == 1.0)
    assert np.max(np.abs(log["wrench_estimated"][:, 3:])) < 1.0


def pushed_at_random(K, D, count=100, spacing=0.6, rate=250.0):
    """Energy that the port took in from the begin of each push to that of the next [J]."""
    random = np.random.default_rng(7)
    pushes = []
    for k in range(count):
        start = spacing * k
        way = random.normal(size=6) * [0.05, 0.05, 0.05, 3.0, 3.0, 2.0]
        lasts = float(random.uniform(0.05, 0.3))
        pushes.append(
            Push(kind="push", start=start, end=start + lasts, moment=way[:3], force=way[3:])
        )
    changes = [
        impedance(K, D), f"controller.rate={rate}", f"integration.max_step={1 / rate}",
        f"log_rate={rate}", f"duration={spacing * count}", "disturbances=null",
    ]  # fmt: skip
    scenario = load_scenario(WIND, changes)
    scenario = replace(scenario, disturbances=DisturbanceSettings(pushes=pushes, rate=rate))
    log = run_tension_scenario(scenario).log
    assert np.all(log["feasible"][1:] == 1.0)
    energy = port_energy(log["X_WP"], log["applied_wrench"])
    rows = np.append(np.round(spacing * rate * np.arange(count)).astype(int), len(energy) - 1)
    return np.diff(energy[rows]), np.ptp(energy)


def test_the_port_of_an_impedance_takes_in_energy_at_every_one_of_100_random_pushes():
    """Between rests, so that nothing is stored: what went in less what came out."""
    omega = 2.0 * np.pi * 2.0
    taken, whole = pushed_at_random(MASS * omega**2, 2.0 * 0.7 * MASS * omega)
    STORED = 1e-3  # of all: what one push leaves to the next when it has not quite come to rest
    assert np.all(taken > -STORED * whole)
    assert np.sum(taken > 0.0) >= 99


def test_a_sampled_spring_without_a_damper_gives_energy():
    """K T / 2 without D: the measurement sees a port that is not passive."""
    log = run(
        WIND, impedance(600.0, 0.0), "controller.rate=50", "integration.max_step=0.005",
        "disturbances={pushes: [{kind: push, start: 0.0, end: 0.1, force: [1.0, 0.0, 0.0]}]}",
        "duration=2",
    ).log  # fmt: skip
    away = log["X_WP"][:, 4] - log["X_WP_desired"][:, 4]
    early, late = np.max(np.abs(away[:70])), np.max(np.abs(away[-70:]))
    assert late > 1.5 * early


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        (WIND, ("force_control={kind: impedance}",), "stiffness: found none with impedance"),
        (WIND, ("force_control={kind: hybrid}",), "axes: found none with hybrid; accepted: it"),
        (WIND, ("force_control={kind: tracking, force: [0, 0, 1]}",), "force: found one with"),
        (WIND, ("integration.engine=compiled",), "found compiled beside force_control"),
        (WIND, ("controller.balance=force",), "balance: found force beside force_control"),
        (WIND, ("predictive={}",), "force_control: found beside predictive"),
        (WIND, ("disturbances={pushes: []}",), "disturbances.pushes: found none"),
        (LED, ("force_control.mass=[0, 1, 1, 1, 1, 1]",), "mass: found 0; accepted: above 0"),
        (HELD, ("force_control.axes=[w]",), "axes"),
        (
            "planar_computed_torque",
            ("force_control={kind: tracking, reject: true}",),
            "found a section for planar, 2T1R",
        ),
    ],
)
def test_what_is_refused(name, changes, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario(name, changes)


def test_repeated_runs_keep_the_plant():
    scenario, words = set_engine(load_scenario(LED, ()), repeated=True)
    assert engine_of(scenario) == "plant"
    assert words == ""
