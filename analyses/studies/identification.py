"""Study: how well a robot's dynamics are identified, and what that is worth to its control.

It repeats identifications over seeds: errors beside the covariance that each reports and beside
the Cramer-Rao bound, designed excitations beside random ones, and simulated campaigns whose robot
tracks a motion with what was found.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydrake.math import RigidTransform
from rich.table import Table
from scipy.stats import chi2

from cdpr_drake.analyses.calibration.identification_campaign import (
    campaign_robots,
    excitation_task,
    run_dynamic_campaign,
)
from cdpr_drake.analyses.calibration.identified_robots import dynamic_model, platform_size
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row, rotation_from_vector
from cdpr_drake.identification.excitation import design_excitation
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.program import IdentificationProgram
from cdpr_drake.identification.regressor import inertia_regressor
from cdpr_drake.identification.samples import LoggedMotion, sample_motion
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

NOISE, CAMPAIGN = "noise", "campaign"
SEEDS, QUICK_SEEDS = 100, 2
CAMPAIGNS, QUICK_CAMPAIGNS = 10, 1
"""Seeds of which a campaign is simulated."""

SURE = 0.01
"""Share of studies with right covariances in which chi-square of all seeds is called wrong."""

CONSISTENT = 0.1
"""By which chi-square per degree of freedom may differ from 1 and be right in part."""

BOUND_WITHIN = 0.2
BETTER = 1.5
"""Times that standard errors of a random excitation are as large, in the median."""

OUTSIDE_WITHIN, TRACKING_WITHIN = 1.5, 0.2


def cases(form: Form) -> Iterator[Case]:
    """Logs with noise, and campaigns."""
    most = {NOISE: None, CAMPAIGN: QUICK_CAMPAIGNS if form.quick else CAMPAIGNS}
    for kind in (NOISE, CAMPAIGN):
        yield Case(name=kind, keys={"kind": kind}, most=most[kind])


def measure(case: Case, seed: int) -> dict[str, Any]:
    """One trial, see `noise_trial` and `campaign_trial`."""
    return noise_trial(seed) if case.keys["kind"] == NOISE else campaign_trial(seed)


def parameters(form: Form) -> Mapping[str, Any]:
    """All that the numbers depend on but the seeds."""
    return {
        "scenario": SCENARIO, "unknown": UNKNOWN, "log_rate_hz": LOG_RATE,
        "bandwidth_hz": BANDWIDTH, "poses": POSES, "sigma_tensions_n": SIGMA_TENSIONS,
        "sigma_place_m": SIGMA_PLACE, "sigma_turn_rad": SIGMA_TURN, "preload_n": PRELOAD,
        "names": NAMES, "who": WHO,
    }  # fmt: skip


def noise_trial(seed: int) -> dict[str, Any]:
    """One identification of a body of unknown mass in exactly known motion, from a log whose noise
    is the only thing that is wrong.

    Returns:
        errors: of the ten parameters, as `NAMES`, in SI units; std: as reported; bound:
        Cramer-Rao's for smoothed poses and tensions with this noise; random_bound: that of a
        random excitation, for the same time; squares: errors over their covariance, squared;
        spread: of the residuals.
    """
    loaded = load_scenario(SCENARIO, (f"seed={seed}",))
    assert isinstance(loaded, TensionScenario)
    random = np.random.default_rng([seed, 31])
    true, believed = campaign_robots(loaded, random)
    asked = excitation_task(loaded, believed)
    best = design_excitation(asked, POSES, random).trajectory
    other = design_excitation(asked, POSES, random, rounds=0).trajectory
    truth, belief = dynamic_model(true), dynamic_model(believed)
    samples = _samples(best, true, truth, asked.cables, random)
    program = IdentificationProgram(belief, UNKNOWN, size=platform_size(true))
    program.AddMotion(samples)
    found = program.Solve(outliers=False)
    errors = found.values - program.layout.values(truth.vector())
    bounds = []
    for motion in (best, other):
        exact = _samples(motion, true, truth, asked.cables, None)
        at_truth = IdentificationProgram(truth, UNKNOWN, size=platform_size(true))
        at_truth.AddMotion(exact)
        bounds.append(np.sqrt(np.diag(at_truth.FindCovariance())))
    bounds[1] = bounds[1] * np.sqrt(other.end_time / best.end_time)
    return {
        "errors": errors.tolist(), "std": found.std.tolist(), "bound": bounds[0].tolist(),
        "random_bound": bounds[1].tolist(),
        "squares": errors @ np.linalg.solve(found.covariance, errors), "spread": found.spread,
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
    found = sample_motion(time, table, tensions, cables, BANDWIDTH)
    if random is not None:
        return found
    sigma = np.full(cables.count, SIGMA_TENSIONS)
    return replace(found, sigma_tensions=sigma, sigma_turn=SIGMA_TURN, sigma_place=SIGMA_PLACE)


def campaign_trial(seed: int) -> dict[str, Any]:
    """One campaign with motors and elastic cables.

    Returns:
        tracking_m, tracking_rad: mean distances and angles by what is believed in, as `WHO`;
        misfit_fitted, misfit_validated: what is not explained of the fitted and of the other log,
        by what was "identified" and "believed", by name of `MISFITS`; platform: errors of mass,
        centre of mass and inertia over their standard errors, as `NAMES`.
    """
    loaded = load_scenario(SCENARIO, (f"seed={seed}",))
    assert isinstance(loaded, TensionScenario)
    run = run_dynamic_campaign(loaded)
    result, both = run.identification.result, run.identification
    assert both.validated is not None
    misfit = [
        {
            who: {what: log.misfit[who][what] for what in MISFITS}
            for who in ("identified", "believed")
        }
        for log in (both.fitted, both.validated)
    ]
    truth = run.truth
    values = np.concatenate([[truth.mass], truth.center_of_mass, truth.inertia])
    return {
        "tracking_m": [run.tracking[who]["mean_m"] for who in WHO],
        "tracking_rad": [run.tracking[who]["mean_rad"] for who in WHO],
        "misfit_fitted": misfit[0],
        "misfit_validated": misfit[1],
        "platform": ((result.values[:10] - values) / result.std[:10]).tolist(),
    }


@statement(
    "errors are as large as covariances say",
    "chi-square per degree of freedom of errors: 1",
    rule=f"within what {1 - SURE:.0%} of all studies with right covariances find; in part within "
    f"{CONSISTENT:g} of 1",
    basis=OURS,
)
def covariance(runs: Runs) -> Finding:
    """Errors beside covariances."""
    squares = runs(kind=NOISE)["squares"]
    count = len(NAMES) * len(squares)
    ratio = float(np.sum(squares)) / count
    low, high = chi2.ppf([SURE / 2, 1 - SURE / 2], count) / count
    return Finding(
        found=f"{ratio:.3f} (accepted {low:.3f} to {high:.3f})",
        held=[low < ratio < high],
        some=abs(ratio - 1.0) < CONSISTENT,
    )


@statement(
    "errors are at the Cramer-Rao bound of smoothed poses and tensions",
    "rms of errors over their bounds: 0.8 to 1.2",
    basis=OURS,
)
def bound(runs: Runs) -> Finding:
    """Errors beside their bound."""
    noise = runs(kind=NOISE)
    ratios = noise["errors"] / noise["bound"]
    each = _rms(ratios)
    total = float(np.sqrt(np.mean(ratios**2)))
    return Finding(
        found=f"{total:.3f}; single parameters {each.min():.2f} to {each.max():.2f}",
        held=[abs(total - 1.0) < BOUND_WITHIN],
    )


@statement(
    "designed excitations tell more than random ones of the same time and limits",
    f"standard errors of random ones over those: at least {BETTER} in the median",
    rule="in part: more than once in the median",
    basis=OURS,
)
def designed(runs: Runs) -> Finding:
    """Bounds of random excitations beside those of designed ones."""
    noise = runs(kind=NOISE)
    ratio = noise["random_bound"] / noise["bound"]
    share, middle = float(np.mean(np.all(ratio > 1.0, axis=1))), float(np.median(ratio))
    return Finding(
        found=f"{middle:.2f}; all ten smaller in {100 * share:.0f} % of the seeds",
        held=[middle >= BETTER],
        some=middle > 1.0,
    )


@statement(
    "a log that was not fitted is explained as well as the one that was",
    f"forces and moments not explained: at most {OUTSIDE_WITHIN} times as much",
    rule="each campaign; in part: the median one",
    basis=OURS,
)
def outside(runs: Runs) -> Finding:
    """What is not explained of another log."""
    campaigns = runs(kind=CAMPAIGN)
    fitted, other, before = (
        np.array([[misfit[who][what] for what in MISFITS[:2]] for misfit in campaigns.list(log)])
        for log, who in (
            ("misfit_fitted", "identified"),
            ("misfit_validated", "identified"),
            ("misfit_validated", "believed"),
        )
    )
    ratio = other / fitted
    return Finding(
        found=f"{np.max(ratio):.2f} times at most; before, {np.min(before / other):.0f} times "
        "that or more",
        held=np.all(ratio < OUTSIDE_WITHIN, axis=1).tolist(),
        some=bool(np.median(ratio) < OUTSIDE_WITHIN),
    )


@statement(
    "with the identified robot the platform tracks as with the true one",
    "mean distance within 20 %",
    rule="each campaign; in part: the median one",
    basis=OURS,
)
def tracking(runs: Runs) -> Finding:
    """Tracking by what is believed in."""
    place = runs(kind=CAMPAIGN)["tracking_m"]
    excess = place[:, 1] / place[:, 2] - 1.0
    words = ", ".join(f"{who} {1e3 * np.mean(place[:, k]):.3f} mm" for k, who in enumerate(WHO))
    return Finding(
        found=f"{words}; {100 * np.max(excess):.0f} % more at most",
        held=(excess < TRACKING_WITHIN).tolist(),
        some=bool(np.median(excess) < TRACKING_WITHIN),
    )


def _rms(values: Array) -> Array:
    """Root mean square over seeds."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def table(runs: Runs) -> Table:
    """Errors by parameter."""
    noise = runs(kind=NOISE)
    errors, bounds = noise["errors"], noise["bound"]
    made = new_table(
        f"Identifications, {len(noise)} seeds", ("parameter",),
        ("rms error", "std. error", "error over bound", "random over designed"),
    )  # fmt: skip
    columns = zip(
        _rms(errors), np.mean(noise["std"], axis=0), _rms(errors / bounds),
        np.median(noise["random_bound"] / bounds, axis=0), strict=True,
    )  # fmt: skip
    for name, (error, std, over, ratio) in zip(NAMES, columns, strict=True):
        made.add_row(name, f"{error:.2g}", f"{std:.2g}", f"{over:.2f}", f"{ratio:.2f}")
    return made


def figure(runs: Runs) -> Figure:
    """Chi-square beside its distribution, errors over bounds, tracking."""
    drawn, axes = new_figure(1, 3, (16.0, 5.0), "Identification over seeds")
    if runs.has(kind=NOISE):
        _draw_noise(axes[0], axes[1], runs(kind=NOISE))
    if runs.has(kind=CAMPAIGN):
        place = 1e3 * runs(kind=CAMPAIGN)["tracking_m"]
        for k, who in enumerate(WHO):
            axes[2].plot(place[:, k], marker="osv"[k], label=who, **line_style(nth_look(k)))
        axes[2].set_yscale("log")
    axes[0].set(xlabel="errors over covariance, squared [-]", ylabel="share of seeds [-]",
                title="covariance")  # fmt: skip
    axes[1].set(ylabel="over the bound of the designed motion [-]", title="Cramer-Rao")
    axes[2].set(xlabel="seed [-]", ylabel="mean distance [mm]", title="tracking by belief")
    for one in axes:
        if one.get_legend_handles_labels()[0]:
            one.legend()
    return drawn


def _draw_noise(shares: Axes, bars: Axes, noise: Runs) -> None:
    values, places = np.sort(noise["squares"]), np.arange(len(NAMES))
    share = (np.arange(len(values)) + 0.5) / len(values)
    shares.plot(values, share, marker="o", label="found", **line_style(nth_look(0)))
    low, high = chi2.ppf([0.001, 0.999], len(NAMES))
    x = np.linspace(float(low), float(high), 200)
    shares.plot(x, chi2.cdf(x, len(NAMES)), label="chi-square", **line_style(BOUND))
    over = _rms(noise["errors"] / noise["bound"])
    ratio = np.median(noise["random_bound"] / noise["bound"], axis=0)
    bars.bar(places - 0.2, over, 0.4, label="rms error", **bar_style(nth_look(1)))
    bars.bar(places + 0.2, ratio, 0.4, label="bound, random poses", **bar_style(nth_look(2)))
    bars.axhline(1.0, **line_style(BOUND))
    bars.set_xticks(places, NAMES, rotation=60)
    bars.margins(y=0.3)  # for the legend


STUDY = Study(
    name="identification",
    title="Dynamics from noisy logs beside covariance and Cramer-Rao bound, and from campaigns",
    cases=cases,
    measure=measure,
    seeds=(SEEDS, QUICK_SEEDS),
    checks=(covariance, bound, designed, outside, tracking),
    tables=[table],
    figures={"identification": figure},
    parameters=parameters,
    unit="trials",
)
