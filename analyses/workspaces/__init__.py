"""Workspaces of robots over grids of poses: which poses are inside, and measures of those.

* `workspace`: the verb `compute_workspace` and its result, of `cdpr workspace`. `KINDS` and
  `MEASURES` of `conditions` are the tables of kinds and measures by name; a new kind is a row.
  `robot_conditions` has what they know of a robot.
* `stability`: the verb `assess_stability` and its result, of `cdpr stability`: where a visual servo
  is stable in spite of perturbations.
* `pose_grid` and `grid_runs`: what both share: grids, chunks of poses that are kept and found
  again, and the file of their arrays.

Figures are imported when they are drawn.

Source: workspaces: Gazebo thesis 2.6, servoing thesis 1.2.2 and 1.3.3; control stability:
servoing thesis 3.3.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
