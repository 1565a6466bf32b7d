"""The groups of benchmarks that `cdpr bench` knows."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_drake.analyses.benchmarks.batches import batch_rows
from cdpr_drake.analyses.benchmarks.behaviours import behaviour_rows
from cdpr_drake.analyses.benchmarks.cameras import camera_rows
from cdpr_drake.analyses.benchmarks.constraints import constraint_rows
from cdpr_drake.analyses.benchmarks.design import design_rows
from cdpr_drake.analyses.benchmarks.forces import force_rows
from cdpr_drake.analyses.benchmarks.identification import calibration_rows, identification_rows
from cdpr_drake.analyses.benchmarks.learning import learning_rows
from cdpr_drake.analyses.benchmarks.package import package_rows
from cdpr_drake.analyses.benchmarks.planning import planning_rows
from cdpr_drake.analyses.benchmarks.point_calibration import point_calibration_rows
from cdpr_drake.analyses.benchmarks.servo import servo_rows
from cdpr_drake.analyses.benchmarks.simulation import effect_rows, simulation_rows
from cdpr_drake.analyses.benchmarks.stability import stability_rows
from cdpr_drake.analyses.benchmarks.statics import physics_rows
from cdpr_drake.analyses.benchmarks.tensions import tension_rows
from cdpr_drake.analyses.benchmarks.workspaces import workspace_rows
from cdpr_drake.analyses.reporting.timing import TimingRow

BENCH_GROUPS: dict[str, Callable[[bool], list[TimingRow]]] = {
    "batch": batch_rows,
    "calibration": lambda quick: [*calibration_rows(quick), *point_calibration_rows(quick)],
    "cameras": camera_rows,
    "constraints": constraint_rows,
    "design": design_rows,
    "forces": force_rows,
    "identification": identification_rows,
    "learning": learning_rows,
    "package": package_rows,
    "physics": lambda quick: [*physics_rows(quick), *effect_rows(quick), *behaviour_rows(quick)],
    "planning": planning_rows,
    "servo": servo_rows,
    "simulation": simulation_rows,
    "stability": stability_rows,
    "tension": tension_rows,
    "workspace": workspace_rows,
}
"""Rows by name of the group; the argument asks for the quick form."""
