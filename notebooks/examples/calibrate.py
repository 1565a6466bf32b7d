"""Calibration: a simulated robot goes to the poses that tell most, and its points are found.

The servo believes in exit points 10 mm and anchor points 5 mm off the simulated truth.
"""

import cdpr_drake as cdpr

wrong = ["perturbations.exit_points=0.01", "perturbations.anchor_points=0.005"]
scenario = cdpr.load_scenario("acrobot_pbvs_line", ["camera.kind=projected", *wrong])
found = cdpr.calibrate_campaign(scenario, poses=12)
print(found)
