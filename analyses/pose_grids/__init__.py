"""What questions over a grid of poses share: their grid, their run, their file, their numbers.

`cdpr stability` and `cdpr workspace` are such questions: each says its tasks and makes a result of
their arrays; how chunks are kept, found again and computed in processes or on a cluster is here.
"""

from cdpr_drake.analyses.pose_grids.grids import check_grid, grid_arguments, plain
from cdpr_drake.analyses.pose_grids.results import load_grid, region_numbers, save_grid
from cdpr_drake.analyses.pose_grids.runs import ARRAYS, PoseRun, SweepOptions, run_poses

__all__ = [
    "ARRAYS", "PoseRun", "SweepOptions", "check_grid", "grid_arguments", "load_grid", "plain",
    "region_numbers", "run_poses", "save_grid",
]  # fmt: skip
