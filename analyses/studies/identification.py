"""Study: how well a robot's dynamics are identified, and what that is worth to its control.

It repeats identifications over seeds: errors beside the covariance that each reports and beside
the Cramer-Rao bound, designed excitations beside random ones, and simulated campaigns whose robot
tracks a motion with what was found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydrake.math import RigidTransform

from cdpr_drake.analyses.fits.identify_campaign import (
    campaign_robots,
    excitation_task,
    simulate_campaign,
)
from cdpr_drake.analyses.frame.figures import bar_style, line_style, new_figure
from cdpr_drake.analyses.studies.calibration import by_degrees, draw_chi_square
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row, rotation_from_vector
from cdpr_drake.identification.excitation import design_excitation
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import inertia_regressor
from cdpr_drake.identification.samples import LoggedMotion, sample_motion
from cdpr_drake.models.robot_dynamics import dynamic_model, platform_size
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import BOUND, nth_look
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory

SCENARIO = "acrobot_computed_torque"
UNKNOWN = ("mass", "center_of_mass", "inertia")
LOG_RATE, BANDWIDTH, POSES = 250.0, 8.0, 12

SIGMA_TENSIONS, SIGMA_PLACE, SIGMA_TURN = 0.2, 1e-4, 2e-4
"""Noise of tension sensors [N] and of the tracker [m, rad]."""

PRELOAD = 20.0
"""Tensions about which those of least norm balance the motion [N]."""

WHO = ("believed before", "identified", "true")
MISFITS = ("force_n", "moment_nm", "length_m", "friction_nm")
NAMES = ("mass", "c x", "c y", "c z", "I xx", "I yy", "I zz", "I xy", "I xz", "I yz")


def noise_row(seed: int) -> dict[str, Any]:
    """One identification of a body of unknown mass in exactly known motion, from a log whose noise
    is the only thing that is wrong.

    Returns:
        errors: of the ten parameters, as `NAMES`, in SI units; std: as reported; bound:
        Cramer-Rao's for smoothed poses and tensions with this noise; random_bound: that of a
        random excitation, for the same time; squares: errors over their covariance, squared;
        spread: of the residuals; rms_over_bound: of errors over bounds; random_over_designed: of
        the bounds, by name.
    """
    loaded = load_scenario(SCENARIO, (f"seed={seed}",))
    assert isinstance(loaded, TensionScenario)
    random = np.random.default_rng([seed, 31])
    true, believed = campaign_robots(loaded, random)
    task = excitation_task(loaded, believed)
    best = design_excitation(task, POSES, random).trajectory
    other = design_excitation(task, POSES, random, rounds=0).trajectory
    truth, belief = dynamic_model(true), dynamic_model(believed)
    samples = _samples(best, true, truth, task.cables, random)
    program = IdentificationProgram(belief, UNKNOWN, size=platform_size(true))
    program.AddMotion(samples)
    result = program.Solve(outliers=False)
    errors = result.values - program.layout.values(truth.vector())
    bounds = []
    for motion in (best, other):
        exact = _samples(motion, true, truth, task.cables, None)
        at_truth = IdentificationProgram(truth, UNKNOWN, size=platform_size(true))
        at_truth.AddMotion(exact)
        bounds.append(np.sqrt(np.diag(at_truth.FindCovariance())))
    bounds[1] = bounds[1] * np.sqrt(other.end_time / best.end_time)
    return {
        "errors": errors.tolist(), "std": result.std.tolist(), "bound": bounds[0].tolist(),
        "random_bound": bounds[1].tolist(),
        "squares": errors @ np.linalg.solve(result.covariance, errors), "spread": result.spread,
        "rms_over_bound": np.sqrt(np.mean((errors / bounds[0]) ** 2)),
        "random_over_designed": dict(zip(NAMES, bounds[1] / bounds[0], strict=True)),
    }  # fmt: skip


def _samples(
    motion: PoseTrajectory, true: Robot, truth: DynamicModel, cables: CableSet,
    random: np.random.Generator | None,
) -> LoggedMotion:  # fmt: skip
    """A log of a motion, smoothed; without random numbers exact, with the same sigmas."""
    time = np.arange(0.0, motion.end_time, 1.0 / LOG_RATE)
    rows = np.array([motion.motion(t) for t in time])
    poses = [motion.pose(t) for t in time]
    R = np.array([X.rotation().matrix() for X in poses])
    F = inertia_regressor(R, rows[:, 7:13], rows[:, 13:], true.gravity_vector()) @ truth.inertial()
    tensions = np.empty((len(time), cables.count))
    for n, (X, wrench) in enumerate(zip(poses, F, strict=True)):
        W = -cable_jacobian(X, cables).T
        even = np.full(cables.count, PRELOAD)
        tensions[n] = even + np.linalg.pinv(W) @ (wrench - W @ even)
    if random is not None:
        tensions += SIGMA_TENSIONS * random.standard_normal(tensions.shape)
        poses = [
            RigidTransform(
                rotation_from_vector(SIGMA_TURN * random.standard_normal(3)) @ X.rotation(),
                X.translation() + SIGMA_PLACE * random.standard_normal(3),
            )
            for X in poses
        ]
    table = np.array([pose_row(X) for X in poses])
    motion_log = sample_motion(time, table, tensions, cables, BANDWIDTH)
    if random is not None:
        return motion_log
    sigma = np.full(cables.count, SIGMA_TENSIONS)
    return replace(motion_log, sigma_tensions=sigma, sigma_turn=SIGMA_TURN, sigma_place=SIGMA_PLACE)


def campaign_row(seed: int) -> dict[str, Any]:
    """One campaign with motors and elastic cables.

    Returns:
        tracking_m, tracking_rad: mean distances and angles by what is believed in, as `WHO`;
        misfit_fitted, misfit_validated: what is not explained of the fitted and of the other log,
        by what was "identified" and "believed", by name of `MISFITS`; platform: errors of mass,
        centre of mass and inertia over their standard errors, as `NAMES`; tracking_excess: of the
        mean distance of the identified robot over that of the true one; force_ratio, moment_ratio:
        what is not explained of the other log over that of the fitted one [-].
    """
    loaded = load_scenario(SCENARIO, (f"seed={seed}",))
    assert isinstance(loaded, TensionScenario)
    fit = simulate_campaign(loaded)
    result, both, tracking = fit.result, fit.source, fit.details["campaign"]["tracking"]
    assert both.validated is not None
    fitted, validated = (
        {
            who: {what: log.misfit[who][what] for what in MISFITS}
            for who in ("identified", "believed")
        }
        for log in (both.fitted, both.validated)
    )
    force, moment = (
        validated["identified"][name] / fitted["identified"][name] for name in MISFITS[:2]
    )
    values = np.array([unknown.true for unknown in fit.unknowns[:10]])
    distances = [tracking[who]["mean_m"] for who in WHO]
    return {
        "tracking_m": distances, "tracking_rad": [tracking[who]["mean_rad"] for who in WHO],
        "misfit_fitted": fitted, "misfit_validated": validated,
        "platform": ((result.values[:10] - values) / result.std[:10]).tolist(),
        "tracking_excess": distances[1] / distances[2] - 1.0,
        "force_ratio": force, "moment_ratio": moment,
    }  # fmt: skip


def cases(form: Form) -> Iterator[Case]:
    """Logs with noise, and campaigns."""
    limit = 1 if form.quick else 10
    yield Case(keys={"kind": "noise"}, call=partial(noise_row), seeds=form.times(100, 2))
    campaigns = form.times(100, 2, limit)
    yield Case(keys={"kind": "campaign"}, call=partial(campaign_row), seeds=campaigns)


def covariance(rows: Frame) -> tuple[list[bool], str]:
    """Errors beside covariances: chi-square per degree of freedom."""
    squares = select(rows, kind="noise")["squares"]
    held, words = by_degrees(squares, len(NAMES) * len(squares))
    return [held], words


def lists(rows: Frame, column: str) -> Array:
    """Lists of a column, shape (rows, n)."""
    return np.array(rows[column].tolist())


def table(rows: Frame) -> Frame:
    """Errors by parameter, over the seeds."""
    noise = select(rows, kind="noise")
    errors, bounds = lists(noise, "errors"), lists(noise, "bound")
    return Frame({
        "parameter": NAMES, "rms error": _rms(errors), "std. error": lists(noise, "std").mean(0),
        "error over bound": _rms(errors / bounds),
        "random over designed": np.median(lists(noise, "random_bound") / bounds, axis=0),
    })  # fmt: skip


def _rms(values: Array) -> Array:
    """Root mean square over seeds."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def figure(rows: Frame) -> Figure:
    """Chi-square beside its distribution, errors over bounds, tracking."""
    drawn, axes = new_figure(1, 3, (16.0, 5.0), "Identification over seeds")
    kinds = dict([*rows.groupby("kind", sort=False)])
    if "noise" in kinds:
        draw_chi_square(axes[0], kinds["noise"]["squares"], len(NAMES))
        errors, places = table(rows), np.arange(len(NAMES))
        for shift, column, words, look in (
            (-0.2, "error over bound", "rms error", nth_look(1)),
            (0.2, "random over designed", "bound, random poses", nth_look(2)),
        ):
            axes[1].bar(places + shift, errors[column], 0.4, label=words, **bar_style(look))
        axes[1].axhline(1.0, **line_style(BOUND))
        axes[1].set_xticks(places, NAMES, rotation=60)
        axes[1].margins(y=0.3)  # for the legend
    if "campaign" in kinds:
        distances = 1e3 * lists(kinds["campaign"], "tracking_m")
        for k, who in enumerate(WHO):
            axes[2].plot(distances[:, k], marker="osv"[k], label=who, **line_style(nth_look(k)))
        axes[2].set_yscale("log")
    axes[0].set(xlabel="errors over covariance, squared [-]", ylabel="share of seeds [-]",
                title="covariance")  # fmt: skip
    axes[1].set(ylabel="over the bound of the designed motion [-]", title="Cramer-Rao")
    axes[2].set(xlabel="seed [-]", ylabel="mean distance [mm]", title="tracking by belief")
    for panel in axes:
        if panel.get_legend_handles_labels()[0]:
            panel.legend()
    return drawn


STUDY = Study(
    name="identification",
    title="Dynamics from noisy logs beside covariance and Cramer-Rao bound, and from campaigns",
    cases=cases,
    parameters=lambda form: {
        "scenario": SCENARIO, "unknown": UNKNOWN, "log_rate_hz": LOG_RATE,
        "bandwidth_hz": BANDWIDTH, "poses": POSES, "sigma_tensions_n": SIGMA_TENSIONS,
        "sigma_place_m": SIGMA_PLACE, "sigma_turn_rad": SIGMA_TURN, "preload_n": PRELOAD,
        "names": NAMES, "who": WHO,
    },
    finds={"covariance": covariance},
    tables={"Identifications over seeds": table},
    figures={"identification": figure},
)  # fmt: skip
