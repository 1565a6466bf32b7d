"""Adaptation: what it is worth to learn exit and anchor points while a visual servo runs.

`python adaptation.py 20` repeats all runs twenty times, with other noise and other wrong points.
"""

import sys

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

import cdpr_drake as cdpr

FLAWS = {
    "frozen encoder": [
        "sensors.log=[encoder]",
        "failures.events=[{kind: sensor_freezes, sensor: encoder, cable: 3, time: 1.0}]",
    ],
    "knocked camera": [
        "camera.fault={kind: 'off', start: 2.0, duration: 2.0, offset: [0.01, 0.0, 0.0]}"
    ],
    "points 80 mm off": ["perturbations.exit_points=0.08", "perturbations.anchor_points=0.08"],
}


def approach(seed, distance, learns, changes=()):
    """A run whose model has each exit and anchor point off by a distance [m]."""
    deviation = distance / 3**0.5  # of a coordinate
    prior = f"{{exit_points: {deviation:g}, anchor_points: {deviation:g}, slack_below: 0.5}}"
    words = [f"adaptation={prior if learns else 'null'}", f"seed={seed}"]
    words += [f"perturbations.{each}={distance:g}" for each in ("exit_points", "anchor_points")]
    return cdpr.simulate("acrobot_adaptation", [*words, "integration.engine=compiled", *changes])


def numbers(run, path):
    """Numbers of a run that are better if they are small; `path`: the true model's positions."""
    track = run.log["X_WP"][:, 4:]
    return pd.Series(
        {
            "largest distance from the true model's path": path.query(track)[0].max(),
            "length of the path": np.linalg.norm(np.diff(track, axis=0), axis=1).sum(),
            "time with slack cables": run.as_dict()["slack_cable_seconds"],
            "final error": run.as_dict()["final_position_error_m"],
        }
    )


count = int(sys.argv[1]) if sys.argv[1:] else 1
rows = []
for seed in range(count):
    path = cKDTree(approach(seed, 0.0, False).log["X_WP"][:, 4:])
    for distance in (0.01, 0.02):
        learnt, wrong = approach(seed, distance, True), approach(seed, distance, False)
        row, points = numbers(learnt, path) / numbers(wrong, path), learnt.as_dict()["adaptation"]
        row["error of the points"] = points["points_rms_after_m"] / points["points_rms_before_m"]
        row["largest error over three deviations"] = points["largest_error_in_sigmas"] / 3.0
        row["doubted"] = float(bool(points["doubts"]))
        rows.append(row)
table = pd.DataFrame(rows)
print(f"{len(table)} runs that learn, relative to the same run without learning")
print(table.agg(["median", "max"]).T.assign(above_1=(table > 1.0).sum()).round(3))
for flaw, changes in FLAWS.items():
    runs = [approach(seed, 0.01, True, changes) for seed in range(count)]
    doubted = sum(bool(run.as_dict()["adaptation"]["doubts"]) for run in runs)
    print(f"{flaw}: {doubted} of {count} runs doubted")
