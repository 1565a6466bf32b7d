"""Basin: from which starts visual servos converge, and how many of them are proven to be stable.

`python basin.py 2000` draws 2,000 starts. Errors are as large as the bounds of the verdicts.
"""

import sys
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pandas as pd

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.workspaces import ServoView, robot_stability, static_case
from cdpr_drake.geometry import pose_rows
from cdpr_drake.stability import FixedObject, verdict
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.workspaces.pose_grid import grid_by_count
from cdpr_drake.workspaces.static_feasibility import statically_feasible

LOW, HIGH = [-0.48, -0.48, 0.15, -30, -30, -90], [0.48, 0.48, 1.1, 30, 30, 90]  # [m, deg]
CHANGES = [
    "robot=acrobot_large", "camera.kind=projected", "camera.pixel_noise=0", "duration=40",
    "target.pose.position=[0, 0, 0]", "desired.position=[0, 0, 0.3]",
    "integration={loop: compiled, max_step: 0.00077}",
    "perturbations={exit_points: 0.005, anchor_points: 0.005, initial_pose_shift: "
    "{distance: 0.03, angle_deg: 3}, camera_pose_shift: {distance: 0.01, angle_deg: 3}}",
]  # fmt: skip


def run_block(block, count=20):
    """Servos from a block of starts: how each ends, and what the verdicts say of its start."""
    scheme, first = block
    scenario = cdpr.load_scenario("acrobot_pbvs", [*CHANGES, f"controller.scheme={scheme}"])
    robot, target = cdpr.load_robot(scenario.robot), scenario.target.target()
    X_PC, X_WO = robot.camera_mount("onboard").pose.transform(), scenario.target.pose.transform()
    view = ServoView(FixedObject(X_WO, scenario.desired.transform()), X_PC)
    grid = grid_by_count(robot.frame.lower, robot.frame.upper, (1, 1, 1))
    servo = robot_stability(robot, grid, view, scheme=scheme)
    statics, pinhole = static_case(robot), servo_pinhole(scenario.camera, robot)
    rows = []
    for seed in range(first, first + count):
        numbers = np.random.default_rng(seed).uniform(LOW, HIGH)
        start = cdpr.Pose(position=numbers[:3], angles_deg=numbers[3:])
        X_WP = start.transform()
        R = X_WP.rotation()
        held = statically_feasible(statics, X_WP.translation(), R.matrix())[0]
        if not held or not target.in_view((X_WP @ X_PC).inverse() @ X_WO, pinhole):
            continue
        with suppress(cdpr.CdprError):  # elastic cables do not hold the platform
            run = cdpr.simulate(replace(scenario, initial_pose=start, seed=seed))
            row = {"scheme": scheme, "outcome": run.as_dict()["outcome"]}
            row["turn"] = f"from {np.degrees(R.ToAngleAxis().angle()) // 30 * 30:.0f} deg"
            verdicts = verdict.judge_all_verdicts(servo.case, servo.bounds, pose_rows([X_WP]))
            rows.append(row | {name: 100.0 * each.stable[0] for name, each in verdicts.items()})
    return rows


if __name__ == "__main__":  # workers are new processes, which import this file
    starts = range(0, int(sys.argv[1]) if sys.argv[1:] else 60, 20)
    blocks = [(name, first) for first in starts for name in ("pbvs", "2.5d", "ibvs")]
    rows = pd.DataFrame(row for job in finished_jobs(run_block, blocks) for row in job.result)
    for by in ("scheme", ["scheme", "turn"]):
        groups = rows.assign(converged=100.0 * (rows.outcome == "converged")).groupby(by)
        print(groups.mean(numeric_only=True).round(1).assign(loops=groups.size()), "\n")
    print(rows[rows.certified > 0].value_counts(["scheme", "outcome"], sort=False).to_string())
