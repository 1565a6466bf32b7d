"""Benchmarks of the verdicts on stability."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, seconds_per_call
from cdpr_drake.analyses.studies.stability_recipe import (
    DRAWS,
    recipe_bounds,
    recipe_case,
    recipe_grid,
)
from cdpr_drake.analyses.studies.stability_tables import TABLES
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import cross_matrix, rotation_from_vector
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.stability.criterion import ModelAtPose, stability_matrix
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VERDICTS, VerdictOptions, judge_stability

ROBOT = "acrobot_large"

TABLE = "A.10"
"""The table that is timed in full."""


def stability_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` times fewer poses and leaves the table out."""
    case, grid = recipe_case(ROBOT, "pbvs"), recipe_grid(ROBOT)
    poses = grid.pose_rows()[:: 40 if quick else 5]
    repeats = 3 if quick else 7
    rows = [
        pair_row("pairs, common shifts", case, BASELINE.varied(exits="common", anchors="common"),
                 poses, repeats),
        pair_row("pairs, independent points", case, BASELINE, poses, repeats),
    ]  # fmt: skip
    rows += verdict_rows(case, poses, repeats)
    if not quick:
        rows.append(table_row())
    return rows


def plain_pairs(case: StabilityCase, bounds: PerturbationBounds, pose: Array, draws: int) -> bool:
    """One pose in plain NumPy, as one writes it down: what the kernels are compared with."""
    X_WP, m, cables = RigidTransform(pose[4:]), case.m, case.cables
    R_PC, p_PC = case.X_PC.rotation(), case.X_PC.translation()
    target = case.target.rows(R_PC.matrix()[np.newaxis], (pose[4:] + p_PC)[np.newaxis])
    L = np.zeros((6, 6))
    L[:3, :3], L[3:, 3:] = theta_u_interaction(target.theta_u[0]), -np.eye(3)
    L[3:, :3] = cross_matrix(target.error[0])
    truth = ModelAtPose(X_WP, cables, case.X_PC, L)
    stable = True
    for d in draw_perturbations(pose, bounds, m, draws):
        points = d[18:].reshape(2, m, 3).transpose(0, 2, 1)
        estimate = ModelAtPose(
            RigidTransform(X_WP.rotation() @ rotation_from_vector(d[:3]), pose[4:] + d[3:6]),
            replace(cables, p_WA=cables.p_WA + points[0], p_PB=cables.p_PB + points[1]),
            RigidTransform(R_PC @ rotation_from_vector(d[6:9]), p_PC + d[9:12]),
            L,
        )
        Pi = stability_matrix(truth, estimate)
        try:
            np.linalg.cholesky(Pi + Pi.T)
        except np.linalg.LinAlgError:
            stable = False
    return stable


def core_seconds(work: Callable[[], object]) -> float:
    """Time of one call in seconds of a core [s], which other processes do not lengthen."""
    began = time.process_time()
    work()
    return time.process_time() - began


def pair_row(
    name: str, case: StabilityCase, bounds: PerturbationBounds, poses: Array, repeats: int
) -> TimingRow:
    """Pairs of pose and perturbation a second of one core, against plain NumPy."""
    options = VerdictOptions(draws=DRAWS, threads=1)
    few = poses[:: max(len(poses) // 10, 1)]
    kernel, plain = interleaved(
        [
            lambda: (
                1e-6
                * len(poses)
                * DRAWS
                / core_seconds(lambda: judge_stability(case, bounds, poses, options=options))
            ),
            lambda: (
                1e-6
                * len(few)
                * DRAWS
                / core_seconds(lambda: [plain_pairs(case, bounds, p, DRAWS) for p in few])
            ),
        ],
        repeats,
    )
    meaning = "times as many as plain NumPy"
    return TimingRow(
        name, kernel, "million/s", "plain NumPy", plain, kernel / plain, ratio_means=meaning
    )


def verdict_rows(case: StabilityCase, poses: Array, repeats: int) -> list[TimingRow]:
    """Time of each verdict with its margin, per pose on one core, against the sampled one."""
    options, some = VerdictOptions(draws=DRAWS, threads=1), poses[::10]

    def one(verdict: str) -> float:
        call = seconds_per_call(lambda: judge_stability(case, BASELINE, some, verdict, options), 1)
        return 1e6 * call / len(some)

    figures = interleaved([lambda v=verdict: one(v) for verdict in VERDICTS], min(repeats, 3))  # type: ignore[misc]
    return [
        TimingRow(
            f"{verdict}, a pose", value, "us", "sampled", figures[0], value / figures[0],
            ratio_means="times as long",
        )
        for verdict, value in zip(VERDICTS, figures, strict=True)
    ]  # fmt: skip


def table_row() -> TimingRow:
    """All rows of a published table, sampled, on all cores."""
    table = next(table for table in TABLES if table.name == TABLE)
    case, poses = recipe_case(table.robot, table.scheme), recipe_grid(table.robot).pose_rows()
    jobs = [recipe_bounds(table, name, v) for name, row in table.rows.items() for v in row]
    options = VerdictOptions(draws=DRAWS, margins=False)

    def all_of_them() -> None:
        for bounds in jobs:
            judge_stability(case, bounds, poses, options=options)

    wall = seconds_per_call(all_of_them, 1)
    return TimingRow(
        f"table {TABLE}, {len(jobs)} rows",
        wall,
        "s",
        "30 s",
        30.0,
        30.0 / wall,
        ratio_means="times faster",
    )
