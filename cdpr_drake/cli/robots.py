"""`cdpr robots`: lists the robots that come with the package."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.robot_folder import write_files
from cdpr_drake.cli.terminal import print_json, print_words, wide_console
from cdpr_drake.errors import CdprError, OutputFolderError, accepted_names
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.models.robot_schema import Robot

PAGES = (".html", ".htm")


def is_suspended(robot: Robot) -> bool:
    """Whether every cable pulls upward at the home pose, so that weight has to keep them taut."""
    cables, X_WP = robot.cable_set(), robot.home.transform()
    anchors = X_WP.rotation().matrix() @ cables.p_PB + X_WP.translation()[:, np.newaxis]
    return bool(np.all(cables.p_WA[2] > anchors[2]))


def robot_facts(robot: Robot) -> dict[str, Any]:
    """What a list of robots shows; SI units as the keys end."""
    return {
        "name": robot.name,
        "title": robot.title,
        "motion": robot.motion,
        "cables": len(robot.cables),
        "suspended": is_suspended(robot),
        "underactuated": robot.is_underactuated(),
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


def mechanism_facts(mechanism: Mechanism) -> dict[str, Any]:
    """What a list of mechanisms shows; SI units as the keys end."""
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "cables": len(mechanism.cables),
        "eyelets": sum(len(cable.via) for cable in mechanism.cables),
        "tension_bounds_n": list(mechanism.tension_limits()),
        "assumptions": mechanism.assumptions,
    }


def robots(
    motion: Annotated[
        str | None, typer.Option(help="Only robots of this motion type, such as 3R3T.")
    ] = None,
    cables: Annotated[
        str | None, typer.Option(help="Only robots with this number of cables: 8, 6-8, 7- or -6.")
    ] = None,
    suspended: Annotated[
        bool | None,
        typer.Option(
            "--suspended/--not-suspended", help="Only robots all of whose cables pull upward."
        ),
    ] = None,
    underactuated: Annotated[
        bool | None,
        typer.Option(
            "--underactuated/--not-underactuated",
            help="Only robots with fewer cables than degrees of freedom.",
        ),
    ] = None,
    camera: Annotated[
        bool | None, typer.Option("--camera/--no-camera", help="Only robots that carry a camera.")
    ] = None,
    search: Annotated[
        str | None, typer.Option(help="Only robots with this word in name or title.")
    ] = None,
    gallery: Annotated[
        Path | None,
        typer.Option(help="Write a page of pictures, .html, that opens without a server."),
    ] = None,
    mechanisms: Annotated[
        bool,
        typer.Option("--mechanisms", help="List mechanisms, whose cables join any bodies."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Lists the robots that come with the package; options filter them."""
    if mechanisms:
        choices = (motion, cables, suspended, underactuated, camera, search, gallery)
        if any(choice is not None for choice in choices):
            raise CdprError("--mechanisms: found with other choices; accepted: alone, or --json")
        found = [mechanism_facts(load_mechanism(name)) for name in mechanism_names()]
        if as_json:
            print_json(found)
        else:
            _print_mechanisms(found)
        return
    if gallery is not None:
        _check_page(gallery)
    everything = [load_robot(name) for name in robot_names()]
    properties = (
        (suspended, is_suspended),
        (underactuated, Robot.is_underactuated),
        (camera, lambda robot: bool(robot.cameras)),
    )
    loaded = _chosen(everything, motion, cables, search, properties)
    if gallery is not None:
        _write_gallery(gallery, loaded)
    if as_json:
        print_json([robot_facts(robot) for robot in loaded])
        return
    if gallery is not None:
        print_words(gallery)
        return
    _print_table([robot_facts(robot) for robot in loaded])


def _chosen(
    everything: list[Robot],
    motion: str | None,
    cables: str | None,
    search: str | None,
    properties: Iterable[tuple[bool | None, Callable[[Robot], bool]]],
) -> list[Robot]:
    """Those that all filters let through; there must be one.

    Args:
        everything: All robots.
        motion: Motion type; None: any, as of the others.
        cables: How many cables, see `_range`.
        search: A word in name or title.
        properties: Each with whether a robot must have it, must not, or may.

    Raises:
        CdprError: A filter makes no sense, or none is left.
    """
    tests: list[Callable[[Robot], bool]] = []
    if motion is not None:
        known = sorted({robot.motion for robot in everything})
        if motion.upper() not in known:
            raise CdprError(f"--motion: found {motion!r}; {accepted_names(motion, known)}")
        tests.append(lambda robot: robot.motion == motion.upper())
    if cables is not None:
        low, high = _range(cables)
        tests.append(lambda robot: low <= len(robot.cables) <= high)
    for wanted, has in properties:
        if wanted is not None:
            tests.append(lambda robot, wanted=wanted, has=has: has(robot) == wanted)  # type: ignore[misc]
    if search is not None:
        words = search.lower()
        tests.append(lambda robot: words in f"{robot.name} {robot.title}".lower())
    left = [robot for robot in everything if all(test(robot) for test in tests)]
    if not left:
        raise CdprError(
            f"--motion, --cables, ...: found no robot with all of these; accepted: what one of the "
            f"{len(everything)} has, see cdpr robots"
        )
    return left


def _range(words: str) -> tuple[float, float]:
    """Least and largest number of --cables."""
    found = re.fullmatch(r"(\d{1,4})?(-)?(\d{1,4})?", words.strip())
    if found is None or not any(found.group(k) for k in (1, 3)):
        raise CdprError(f"--cables: found {words!r}; accepted: such as 8, 6-8, 7- or -6")
    low, dash, high = found.groups()
    if dash is None:
        return float(low), float(low)
    return float(low or 0), float(high) if high else np.inf


def _check_page(page: Path) -> None:
    if page.suffix.lower() not in PAGES:  # whose file it would replace
        raise OutputFolderError(f"--gallery: found {page}; accepted: a file that ends in .html")
    if not page.absolute().parent.is_dir():
        raise OutputFolderError(f"{page}: found no folder to write to; accepted: one that exists")


def _write_gallery(page: Path, loaded: list[Robot]) -> None:
    from cdpr_drake.analyses.visualization.robot_gallery import gallery_page

    write_files(page.parent, {page.name: gallery_page(loaded)}, overwrite=True)


def _print_mechanisms(facts: list[dict[str, Any]]) -> None:
    table = Table(title="Mechanisms", box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for heading in ("name", "m", "tensions"):
        table.add_column(heading, no_wrap=True)
    table.add_column("title")
    for f in facts:
        low, high = f["tension_bounds_n"]
        table.add_row(f["name"], str(f["cables"]), f"{low:g}..{high:g} N", f["title"])
    wide_console().print(table)


def _print_table(facts: list[dict[str, Any]]) -> None:
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
