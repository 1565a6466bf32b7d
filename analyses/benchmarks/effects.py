"""Benchmarks of closed loops with physical effects: how much faster than real time they run."""

from __future__ import annotations

from cdpr_drake.analyses.reporting import TimingRow
from cdpr_drake.analyses.runs import run_scenario
from cdpr_drake.systems.diagrams import load_scenario

EFFECTS = {
    "straight cables": ("acrobot_pbvs", ()),
    "pulleys": ("acrobot_pulleys", ()),
    "pulleys, damped elasticity, friction": ("acrobot_friction", ("cables.pulleys=true",)),
    "pulleys, undamped elasticity, friction": ("acrobot_elastic", ()),
    "catenary, pulleys": ("acrobot_pulleys", ("cables.model=catenary",)),
    "CAROCA, straight cables": ("caroca_pbvs", ()),
    "CAROCA, catenary, pulleys": ("caroca_catenary", ()),
}
"""What is on, and the scenario with overrides that has it; the camera is projected."""


def effect_rows(quick: bool) -> list[TimingRow]:
    """Real-time factors of closed loops; `quick` runs each of them once and shorter."""
    duration = 1.0 if quick else 8.0
    rows = []
    for name, (scenario, overrides) in EFFECTS.items():
        times = (f"duration={duration}", f"stop.hold={duration}", "camera.kind=projected")
        loaded = load_scenario(scenario, [*overrides, *times])
        results = [run_scenario(loaded) for _ in range(1 if quick else 3)]
        wall = min(result.wall_time for result in results)
        rows.append(
            TimingRow(
                f"closed loop: {name}",
                wall,
                "s",
                "simulated time",
                results[0].sim_time,
                results[0].sim_time / wall,
                ratio_means="real-time factor",
            )
        )
    return rows
