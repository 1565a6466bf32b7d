"""Many seeds: a visual servo with anchor points that are 5 mm off, here or on a Dask cluster.

`workers="tcp://host:8786"` instead of a number sends the runs to a cluster.
"""

import cdpr_drake as cdpr

if __name__ == "__main__":  # workers are new processes, which import this file
    changes = ["camera.kind=projected", "perturbations.anchor_points=0.005"]
    runs = cdpr.repeat_run("acrobot_pbvs", changes, seeds=range(4), workers=1, folder="runs")
    print(runs)
    print("each, off at the end [mm]:", 1e3 * runs.columns()["final_position_error_m"])
