"""What comes with the package: robots, mechanisms, scenarios."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.frame.files import write_files
from cdpr_drake.analyses.frame.result import Listing, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import words
from cdpr_drake.errors import CdprError, OutputFolderError, accepted_names
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.models.robot_schema import Robot

PAGES = (".html", ".htm")
"""Endings of pages."""


def cable_counts(word: str) -> tuple[float, float]:
    """Least and largest number of cables, of 8, 6-8, 7- or -6."""
    match = re.fullmatch(r"(\d{1,4})?(-)?(\d{1,4})?", word.strip())
    if match is None or not any(match.group(k) for k in (1, 3)):
        raise ValueError(word)
    low, dash, high = match.groups()
    if dash is None:
        return float(low), float(low)
    return float(low or 0), float(high) if high else np.inf


CableCounts = Annotated[
    tuple[float, float] | None, words(cable_counts, "such as 8, 6-8, 7- or -6", "COUNT|FROM-TO")
]


@verb()
def list_robots(
    *, motion: str | None = None, cables: CableCounts = None,
    suspended: Annotated[bool | None, Parameter(negative="--not-suspended")] = None,
    underactuated: Annotated[bool | None, Parameter(negative="--not-underactuated")] = None,
    camera: bool | None = None, search: str | None = None,
    gallery: Annotated[Path | None, words(Path, "a file that ends in .html", "FILE")] = None,
    mechanisms: bool = False,
) -> Listing:  # fmt: skip
    """Lists the robots that come with the package; options filter them.

    Args:
        motion: Only robots of this motion type, such as 3R3T.
        cables: Only robots with this number of cables: 8, 6-8, 7- or -6.
        suspended: Only robots all of whose cables pull upward.
        underactuated: Only robots with fewer cables than degrees of freedom.
        camera: Only robots that carry a camera.
        search: Only robots with this word in name or title.
        gallery: Write a page of pictures, .html, that opens without a server.
        mechanisms: List mechanisms, whose cables join any bodies.

    Raises:
        CdprError: No robot has all of these, or the motion type is unknown.
        OutputFolderError: The page is no .html, or cannot be written.
    """
    filters = (motion, cables, suspended, underactuated, camera, search, gallery)
    if mechanisms:
        if any(choice is not None for choice in filters):
            raise CdprError("mechanisms: found with other choices; accepted: alone")
        return _mechanisms()
    if gallery is not None and gallery.suffix.lower() not in PAGES:  # whose file it would replace
        raise OutputFolderError(f"gallery: found {gallery}; accepted: a file that ends in .html")
    if gallery is not None and not gallery.absolute().parent.is_dir():
        raise OutputFolderError(f"{gallery}: found no folder to write to")
    robots = [load_robot(name) for name in robot_names()]
    motions = sorted({robot.motion for robot in robots})
    if motion is not None and motion.upper() not in motions:
        raise CdprError(f"motion: found {motion!r}; {accepted_names(motion, motions)}")
    low, high = cables or (0.0, np.inf)
    chosen = [
        robot for robot in robots
        if (motion is None or robot.motion == motion.upper())
        and low <= len(robot.cables) <= high
        and suspended in (None, is_suspended(robot))
        and underactuated in (None, robot.is_underactuated())
        and camera in (None, bool(robot.cameras))
        and (search or "").lower() in f"{robot.name} {robot.title}".lower()
    ]  # fmt: skip
    if not chosen:
        raise CdprError(
            f"motion, cables, ...: found no robot with all of these; accepted: what one of the "
            f"{len(robots)} has, see cdpr robots"
        )
    entries = [robot_facts(robot) for robot in chosen]
    if gallery is not None:
        from cdpr_drake.analyses.visualization.robot_gallery import gallery_page

        write_files(gallery.parent, {gallery.name: gallery_page(chosen)}, overwrite=True)
        return Listing(entries, words=[str(gallery)])
    return Listing(entries, Table("Robots", ("name", "motion", "m", "mass", "frame", "speed"), [
        (robot.name, robot.motion, str(len(robot.cables)), f"{robot.platform.mass:g} kg",
         " x ".join(f"{span:g}" for span in robot.frame.upper - robot.frame.lower) + " m",
         f"{robot.winch.rated_cable_speed():.2f} m/s")
        for robot in chosen
    ]))  # fmt: skip


def is_suspended(robot: Robot) -> bool:
    """True if every cable pulls upward at the home pose, so that weight has to keep them taut."""
    cables, X_WP = robot.cable_set(), robot.home.transform()
    anchors = X_WP.rotation().matrix() @ cables.p_PB + X_WP.translation()[:, np.newaxis]
    return bool(np.all(cables.p_WA[2] > anchors[2]))


def robot_facts(robot: Robot) -> dict[str, Any]:
    """What a list of robots says of one; SI units as the keys end."""
    return {
        "name": robot.name, "title": robot.title, "motion": robot.motion,
        "cables": len(robot.cables), "suspended": is_suspended(robot),
        "underactuated": robot.is_underactuated(), "platform_mass_kg": robot.platform.mass,
        "platform_size_m": robot.platform.size.tolist(),
        "frame_m": [robot.frame.lower.tolist(), robot.frame.upper.tolist()],
        "cable_diameter_m": robot.cable.diameter,
        "own_materials": sum(cable.material is not None for cable in robot.cables),
        "youngs_modulus_pa": robot.cable.youngs_modulus,
        "rated_cable_speed_m_s": robot.winch.rated_cable_speed(),
        "tension_bounds_n": list(robot.tension_limits()),
        "cameras": {mount.name: mount.model for mount in robot.cameras},
        "assumptions": robot.assumptions,
    }  # fmt: skip


def _mechanisms() -> Listing:
    entries: list[dict[str, Any]] = [
        {
            "name": mechanism.name, "title": mechanism.title, "cables": len(mechanism.cables),
            "eyelets": sum(len(cable.via) for cable in mechanism.cables),
            "tension_bounds_n": list(mechanism.tension_limits()),
            "assumptions": mechanism.assumptions,
        }
        for mechanism in map(load_mechanism, mechanism_names())
    ]  # fmt: skip
    return Listing(entries, Table("Mechanisms", ("name", "m", "tensions", "title"), [
        (entry["name"], str(entry["cables"]), "{:g}..{:g} N".format(*entry["tension_bounds_n"]),
         entry["title"])
        for entry in entries
    ]))  # fmt: skip


@verb()
def list_scenarios() -> Listing:
    """Lists the scenarios that come with the package."""
    from cdpr_drake.systems.diagrams.load import load_scenario  # which loads all blocks
    from cdpr_drake.systems.scenarios.files import scenario_names

    entries = [scenario_facts(load_scenario(name)) for name in scenario_names()]
    headings = ("name", "robot", "duration", "ends", "what it shows")
    return Listing(entries, Table("Scenarios", headings, [
        (entry["name"], entry["robot"] or entry["mechanism"], f"{entry['duration_s']:g} s",
         "" if entry["expected"] is None else entry["expected"]["outcome"].replace("_", " "),
         entry["title"])
        for entry in entries
    ]))  # fmt: skip


def scenario_facts(scenario: Any) -> dict[str, Any]:
    """What a list of scenarios of any kind says of one; SI units, null where a kind has none."""
    from cdpr_drake.systems.scenarios.files import VISUAL_SERVO

    servo = scenario if scenario.kind == VISUAL_SERVO else None
    return {
        "name": scenario.name, "title": scenario.title, "kind": scenario.kind,
        "robot": getattr(scenario, "robot", None),
        "mechanism": getattr(scenario, "mechanism", None),
        "scheme": servo.controller.scheme if servo else None,
        "target": servo.target.kind if servo else None,
        "camera": scenario.camera.kind if hasattr(scenario, "camera") else None,
        "duration_s": scenario.duration,
        "expected": None if scenario.expected is None else asdict(scenario.expected),
        "source": scenario.source,
    }  # fmt: skip
