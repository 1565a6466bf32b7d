"""Lenses: where a visual servo comes to rest with a lens that is known, half known or ignored.

`python lenses.py 6` repeats each approach six times, with other noise of the pixels.
"""

import sys

import numpy as np

import cdpr_drake as cdpr

BARREL = "camera.distortion={kind: brown_conrady, k1: -0.25, k2: 0.06, p1: 0.001, p2: -0.0008}"
FISHEYE = "camera.distortion={kind: fisheye, k1: -0.02, k2: 0.005}"
HALF = "perturbations.camera_distortion={kind: brown_conrady, k1: -0.125, k2: 0.03}"
IGNORED = "perturbations.camera_distortion={kind: none}"
CAMERAS = {
    "no lens": [],
    "barrel, known": [BARREL],
    "fisheye, known": [FISHEYE],
    "barrel, half of it known": [BARREL, HALF],
    "barrel, ignored": [BARREL, IGNORED],
    "fisheye, ignored": [FISHEYE, IGNORED],
    "principal point 5 px off": ["perturbations.image_bias=[4, -3]"],
}
SCHEMES = ("pbvs", "ibvs", "2.5d")
FAST = ["camera.kind=projected", "integration.engine=compiled", "integration.loop=compiled"]
TIMES = ["duration=12", "stop.hold=24", "log_rate=25"]  # a run goes on after it has arrived


def noise_factor(servo):
    """Error of the camera's place by noise of the pixels, relative to a camera without a lens."""
    deviations = []
    for camera in (servo.pinhole, servo.pinhole.ideal):
        pixels = camera.project(servo.X_CdO @ servo.target.points).ravel()
        places = []
        for step in 0.01 * np.vstack([np.eye(8), -np.eye(8)]):
            corners = camera.read((pixels + step).reshape(2, 4)).T.ravel()
            places.append(servo.target.solve(corners, camera.ideal).inverse().translation())
        deviations.append(np.linalg.norm(np.subtract(places[:8], places[8:])))
    return deviations[0] / deviations[1]


count = int(sys.argv[1]) if sys.argv[1:] else 1
print(f"{'final errors [mm]':26}", *(f"{scheme:>7}" for scheme in SCHEMES), "  noise factor")
for name, changes in CAMERAS.items():
    errors = []
    for scheme in [f"controller.scheme={each}" for each in SCHEMES]:
        squares = []
        for seed in range(count):
            words = [scheme, f"seed={seed}", *changes, *FAST, *TIMES]
            run = cdpr.simulate("acrobot_pbvs", words)
            goal = run.built.desired_platform_pose().translation()
            rest = run.log["time"] >= run.log["time"][-1] - 2.0
            squares.append(np.sum((run.log["X_WP"][rest, 4:] - goal) ** 2, axis=1))
        errors.append(1e3 * np.sqrt(np.mean(squares)))
    factor = noise_factor(run.built)
    print(f"{name:26}", *(f"{error:7.3f}" for error in errors), f"{factor:14.2f}")
