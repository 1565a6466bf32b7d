"""Closed loops from many poses of a stability workspace: does the criterion keep its promise?

Source: servoing thesis 3.3 and 3.4.
"""

from cdpr_drake.analyses.studies.closed_loops.kinematic_servo import kinematic_path
from cdpr_drake.analyses.studies.closed_loops.loops import seen_errors
from cdpr_drake.analyses.studies.closed_loops.servo_models import (
    Perturbation,
    perturbed_scenario,
    perturbed_servo,
)
from cdpr_drake.analyses.studies.closed_loops.study import JUDGES, study_closed_loop

__all__ = [
    "JUDGES", "Perturbation", "kinematic_path", "perturbed_scenario", "perturbed_servo",
    "seen_errors", "study_closed_loop",
]  # fmt: skip
