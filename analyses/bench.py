"""The groups of benchmarks that `cdpr bench` knows."""

from __future__ import annotations

from collections.abc import Callable

from cdpr_drake.analyses.bench_effects import effect_rows
from cdpr_drake.analyses.bench_physics import physics_rows
from cdpr_drake.analyses.bench_servo import servo_rows
from cdpr_drake.analyses.bench_simulation import simulation_rows
from cdpr_drake.analyses.bench_stability import stability_rows
from cdpr_drake.analyses.bench_tension import tension_rows
from cdpr_drake.analyses.timing import TimingRow

BENCH_GROUPS: dict[str, Callable[[bool], list[TimingRow]]] = {
    "physics": lambda quick: [*physics_rows(quick), *effect_rows(quick)],
    "servo": servo_rows,
    "simulation": simulation_rows,
    "stability": stability_rows,
    "tension": tension_rows,
}
"""Rows by name of the group; the argument asks for the quick form."""
