"""Options of questions over a grid of poses, and what their words mean: one set for all of them."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from cdpr_drake.errors import CdprError

GridWords = Annotated[
    str | None,
    typer.Option(
        "--grid",
        help="x,y,z, each a number of points in the default box, or lower:upper:step [m].",
    ),
]
Orientations = Annotated[
    list[str] | None,
    typer.Option(
        "--orientation",
        help="Angles phi,theta,psi of the platform, each a number or lower:upper:step [deg]; may "
        "be repeated.",
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Results folder; without, one named by the arguments below a folder named as the "
        "command."
    ),
]
ForceToResist = Annotated[
    float | None, typer.Option(help="Forces to resist, up to so much along each axis [N].")
]
MomentToResist = Annotated[
    float | None, typer.Option(help="Moments to resist, up to so much about each axis [N m].")
]
Workers = Annotated[int | None, typer.Option(help="Local processes; all processors.")]


def check_workers(workers: int | None) -> None:
    """Raises a CdprError unless there is at least one."""
    if workers is not None and workers < 1:
        raise CdprError(f"--workers: found {workers}; accepted: at least 1")


def check_mass(mass: float | None, *, zero: bool) -> None:
    """Raises a CdprError unless a mass is positive, or with `zero` not negative."""
    if mass is None or (math.isfinite(mass) and (mass > 0.0 or (zero and mass == 0.0))):
        return
    raise CdprError(f"--mass: found {mass:g}; accepted: {'>=' if zero else '>'} 0 [kg]")


def default_folder(command: str, name: str, arguments: dict[str, Any]) -> Path:
    """A folder below the command's that the same arguments find again."""
    digest = hashlib.sha256(json.dumps(arguments, sort_keys=True).encode()).hexdigest()
    return Path(command) / f"{name}-{digest[:8]}"
