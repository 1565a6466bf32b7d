"""What the study of identification repeats, an item of a sweep each."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.calibration.identification_campaign import (
    campaign_robots,
    excitation_task,
    run_dynamic_campaign,
)
from cdpr_drake.analyses.calibration.identified_robots import dynamic_model, platform_size
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


@dataclass(frozen=True)
class NoiseTask:
    """A body of unknown mass in exactly known motion, measured with noise; items are seeds."""

    scenario: str = SCENARIO

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Arrays of `noise_trial`, stacked."""
        return _stacked([noise_trial(self.scenario, seed) for seed in range(start, stop)])


@dataclass(frozen=True)
class CampaignTask:
    """A campaign with motors and elastic cables; items are seeds."""

    scenario: str = SCENARIO

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Arrays of `campaign_trial`, stacked."""
        return _stacked([campaign_trial(self.scenario, seed) for seed in range(start, stop)])


def _stacked(runs: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.array([run[name] for run in runs]) for name in runs[0]}


def noise_trial(scenario: str, seed: int) -> dict[str, Array]:
    """One identification from a log whose noise is the only thing that is wrong.

    Returns:
        errors: Of the ten parameters; std: as reported; bound: Cramer-Rao's for smoothed poses
        and tensions with this noise; shape (10,) each. random: the bound of a random excitation,
        for the same time. squares: errors over their covariance, squared; spread: of the
        residuals.
    """
    loaded = load_scenario(scenario, (f"seed={seed}",))
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
        "errors": errors, "std": found.std, "bound": bounds[0], "random": bounds[1],
        "squares": np.array(errors @ np.linalg.solve(found.covariance, errors)),
        "spread": np.array(found.spread),
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


def campaign_trial(scenario: str, seed: int) -> dict[str, Array]:
    """One campaign.

    Returns:
        tracking: Mean distances [m] and angles [rad] by what is believed in, shape (3, 2);
        misfit: what is not explained of the fitted and of the other log, by what was found and by
        what was believed, shape (2, 2, 4), as `MISFITS`; platform: errors of mass, centre of mass
        and inertia over their standard errors, shape (10,).
    """
    loaded = load_scenario(scenario, (f"seed={seed}",))
    assert isinstance(loaded, TensionScenario)
    run = run_dynamic_campaign(loaded)
    result, both = run.identification.result, run.identification
    assert both.validated is not None
    misfit = [
        [[log.misfit[who][what] for what in MISFITS] for who in ("identified", "believed")]
        for log in (both.fitted, both.validated)
    ]
    truth = run.truth
    values = np.concatenate([[truth.mass], truth.center_of_mass, truth.inertia])
    tracking = [[run.tracking[who][key] for key in ("mean_m", "mean_rad")] for who in WHO]
    return {
        "tracking": np.array(tracking),
        "misfit": np.array(misfit),
        "platform": (result.values[:10] - values) / result.std[:10],
    }
