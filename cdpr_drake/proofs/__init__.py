"""Proofs over continua: at every pose of a box, for every error within bounds, at every instant.

Rooms of grids and laws (`workspaces`, `stability`, `planning`) can be read without this wing.

* **Boxes of poses**: `certify` of `certified_boxes`, of one kind of workspace or several at once,
  and `refine` of `box_refinement` where more is needed; the proofs stand in `box_verdicts_kernel`
  and `box_collision_kernel`.
* **Sets**: `proven_cells`, `cuboid_cover` and `proven_sets` merge boxes to few convex sets whose
  overlaps are a graph; `proven_connection` cuts open cells where two poses need them; `timed_cells`
  and `timed_sets` do so in poses and time, among what moves.
* **Motions**: `proven_path` goes through such sets: `set_sequences` chooses them, `set_curve` draws
  a curve with its control points in them, `box_timing` times it within a box of accelerations at
  every instant; `motion_in_time` does the same in time.
* **Stability**: `certified_kernel` proves that no perturbation within the bounds makes a pose
  unstable, by `quadratic_bounds_kernel` and `subdivision_kernel`; the verdict `certified` of
  `stability.judge_stability` calls it. `no_stable_target` proves that no target makes a pose
  stable.

Source: Bosscher, Riechel and Ebert-Uphoff, Wrench-feasible workspace generation for cable-driven
robots, 2006; Gouttefarde et al., Interval-analysis-based determination of the wrench-feasible
workspace, 2011. The certificate of stability is this project's own.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
