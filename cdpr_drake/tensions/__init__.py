"""Tension distribution: which tensions, with more cables than degrees of freedom?

A problem is W t + w = 0 with lower <= t <= upper, W of shape (n, m), w the wrench of everything
but the cables, (moment [N m], force [N]). `METHODS` is the table of methods; a new one is a kernel
and a row of it. A solution's status is judged and never believed: feasible tensions balance the
wrench within the bounds, infeasible is a proof.

Source: Gazebo thesis 6.2; servoing thesis 1.2.2, (1.27) with its minus sign; Pott, 2018.
"""

from cdpr_drake.tensions.batch import distribute_batch
from cdpr_drake.tensions.closed_form_kernel import closed_form
from cdpr_drake.tensions.control_step_kernel import (
    TensionStep,
    update_tensions,
    update_tensions_at,
    wrench_matrix_at,
)
from cdpr_drake.tensions.methods import (
    METHODS,
    Distributor,
    TensionMethod,
    distribute,
    exact_tensions,
    feasible_polygon,
    method_for,
    solution_space,
)
from cdpr_drake.tensions.null_space_kernel import null_space
from cdpr_drake.tensions.problem import (
    TensionProblem,
    TensionSolution,
    TensionStatus,
    judge_tensions,
)
from cdpr_drake.tensions.program import make_program, program_tensions
from cdpr_drake.tensions.quadratic_program_kernel import (
    FEASIBLE,
    nearest_tensions,
    nearest_tensions_in,
    workspace_shape,
)

__all__ = [
    "FEASIBLE", "METHODS", "Distributor", "TensionMethod", "TensionProblem", "TensionSolution",
    "TensionStatus", "TensionStep", "closed_form", "distribute", "distribute_batch",
    "exact_tensions", "feasible_polygon", "judge_tensions", "make_program", "method_for",
    "nearest_tensions", "nearest_tensions_in", "null_space", "program_tensions", "solution_space",
    "update_tensions", "update_tensions_at", "workspace_shape", "wrench_matrix_at",
]  # fmt: skip
