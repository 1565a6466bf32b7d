"""`cdpr robots`: lists the robots that come with the package."""

from __future__ import annotations

from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.models import Robot, load_robot, robot_names


def robot_facts(robot: Robot) -> dict[str, Any]:
    """What a list of robots shows; SI units as the keys end."""
    return {
        "name": robot.name,
        "title": robot.title,
        "motion": robot.motion,
        "cables": len(robot.cables),
        "platform_mass_kg": robot.platform.mass,
        "platform_size_m": robot.platform.size.tolist(),
        "frame_m": [robot.frame.lower.tolist(), robot.frame.upper.tolist()],
        "cable_diameter_m": robot.cable.diameter,
        "own_materials": sum(cable.material is not None for cable in robot.cables),
        "youngs_modulus_pa": robot.cable.youngs_modulus,
        "rated_cable_speed_m_s": robot.winch.rated_cable_speed(),
        "tension_bounds_n": list(robot.tension_limits()),
        "cameras": {mount.name: mount.model for mount in robot.cameras},
        "assumptions": robot.assumptions,
    }


def robots(as_json: AsJson = False) -> None:
    """Lists the robots that come with the package."""
    facts = [robot_facts(load_robot(name)) for name in robot_names()]
    if as_json:
        print_json(facts)
        return
    table = Table(title="Robots", box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for heading in ("name", "motion", "m", "mass", "frame", "speed"):
        table.add_column(heading, no_wrap=True)
    for f in facts:
        lower, upper = f["frame_m"]
        table.add_row(
            f["name"],
            f["motion"],
            str(f["cables"]),
            f"{f['platform_mass_kg']:g} kg",
            " x ".join(f"{high - low:g}" for low, high in zip(lower, upper, strict=True)) + " m",
            f"{f['rated_cable_speed_m_s']:.2f} m/s",
        )
    wide_console().print(table)
