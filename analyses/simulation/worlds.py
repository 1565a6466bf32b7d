"""What a run says of the world round its robot: summary, figure, columns of its log."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    LEGEND_BESIDE,
    curves,
    draw_curve,
    line_style,
    new_figure,
    shade,
)
from cdpr_drake.analyses.reporting.log_on_disk import Log
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, DISTANCE
from cdpr_drake.systems.scenarios.run_settings import has_contact
from cdpr_drake.systems.worlds.settings import WorldSettings

CABLES = "cables touch nothing: they pass through obstacles, and their clearance tells"


def body_names(world: WorldSettings) -> list[str]:
    """Names of the bodies of a world, in the order of the log's columns."""
    return [*(["ground"] if world.ground else []), *(body.name for body in world.obstacles)]


def world_columns(world: WorldSettings | None) -> dict[str, list[str]]:
    """Names of the columns of the log's quantities that have one for each body."""
    if world is None:
        return {}
    names = [f"{name}_m" for name in body_names(world)]
    return {"clearance": names, "cable_clearance": names}


def world_summary(scenario: Any, log: Log) -> dict[str, Any] | None:
    """Clearances and contact of a run of any kind of scenario; None without a world.

    Times in contact count from row to row of the log; the largest force is that of its rows.
    """
    world = scenario.world
    if world is None:
        return None
    names = body_names(world)
    summary: dict[str, Any] = {
        "bodies": names,
        "least_clearance_m": _least(names, log["clearance"]),
        "final_clearance_m": dict(zip(names, log["clearance"][-1].tolist(), strict=True)),
        "least_cable_clearance_m": _least(names, log["cable_clearance"]),
        "cables": CABLES,
        "contact": None,
    }
    if has_contact(scenario):
        times, touches = log["time"], log["contact_count"][:, 0] > 0.0
        forces = np.linalg.norm(log["contact_force"], axis=1)
        when = np.flatnonzero(touches)
        summary["contact"] = {
            "model": world.contact.model,
            "engine": "plant, since the compiled engine knows no contact",
            "first_s": float(times[when[0]]) if len(when) else None,
            "time_s": float(np.sum(np.diff(times) * touches[:-1])),
            "largest_force_n": float(np.max(forces)),
            "final_force_n": float(forces[-1]),
            "most_points": int(np.max(log["contact_count"])),
        }
    return summary


def _least(names: list[str], clearances: Array) -> dict[str, float | None]:
    """Least of each column; None of those that are not measured."""
    found: dict[str, float | None] = {}
    for name, column in zip(names, clearances.T, strict=True):
        measured = column[np.isfinite(column)]
        found[name] = float(np.min(measured)) if len(measured) else None
    return found


def world_facts(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and words for the table at the end of a run, from its summary."""
    world = summary["world"]
    if world is None:
        return []
    words = []
    for label, key in (("platform", "least_clearance_m"), ("cables", "least_cable_clearance_m")):
        gaps = {name: gap for name, gap in world[key].items() if gap is not None}
        if gaps:
            nearest = min(gaps, key=lambda name: gaps[name])
            words.append(f"{label} {1e3 * gaps[nearest]:.1f} mm from {nearest}")
    facts = [("least clearance", ", ".join(words) or "nothing to measure it from")]
    gaps = world["least_cable_clearance_m"]
    run_through = [name for name, gap in gaps.items() if gap is not None and gap < 0.0]
    if run_through:
        facts.append(("cables", f"pass through {', '.join(run_through)}, without contact"))
    contact = world["contact"]
    if contact is not None:
        said = "none"
        if contact["first_s"] is not None:
            said = (
                f"from {contact['first_s']:.2f} s on, {contact['time_s']:.2f} s in all, at most "
                f"{contact['largest_force_n']:.1f} N"
            )
        facts.append(("contact", said))
    return facts


def world_words(world: WorldSettings) -> str:
    """What `world_figure` shows."""
    return "Clearances of platform and cables" + (", and contact" if world.contact else "")


def world_figure(title: str, world: WorldSettings, log: Log) -> Figure:
    """Clearances of platform and cables over time and, with contact, its force."""
    names, touching = body_names(world), "contact_force" in log
    figure, panels = new_figure(2 + touching, 1, (10.0, 6.5 + 3.0 * touching), title)
    times = log["time"]
    for axes, quantity, label in (
        (panels[0], "clearance", "clearance of the platform [mm]"),
        (panels[1], "cable_clearance", "clearance of the cables [mm]"),
    ):
        shown = [k for k in range(len(names)) if np.any(np.isfinite(log[quantity][:, k]))]
        labels = [names[k] for k in shown]
        curves(axes, times, log[quantity][:, shown], labels, numbers=shown, scale=1e3)
        axes.axhline(0.0, **line_style(BOUND))
        axes.set(xlabel="time [s]", ylabel=label)
        axes.legend(**LEGEND_BESIDE)
    if touching:
        force = np.linalg.norm(log["contact_force"], axis=1)
        draw_curve(panels[2], times, force, DISTANCE, "force on the platform")
        shade(panels[2], times, log["contact_count"][:, 0] > 0.0, "in contact")
        panels[2].set(xlabel="time [s]", ylabel="contact force [N]", ylim=(0.0, None))
        panels[2].legend(**LEGEND_BESIDE)
    return figure
