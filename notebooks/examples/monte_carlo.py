"""Many seeds: a visual servo with anchor points that are 5 mm off, here or on a Dask cluster.

`workers="tcp://host:8786"` instead of a number sends the runs to a cluster.
"""

import cdpr_drake as cdpr

if __name__ == "__main__":  # workers are new processes, which import this file
    changes = ["camera.kind=projected", "perturbations.anchor_points=0.005"]
    found = cdpr.simulate("acrobot_pbvs", changes, "runs", seeds=range(4), workers=1)
    print(found)
    print("each, off at the end [mm]:", 1e3 * found.runs.table()["final_position_error_m"])
