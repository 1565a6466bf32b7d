"""`cdpr tension`: distributes the platform's weight over the cables at one pose."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cdpr_drake.analyses.pictures import save_figure
from cdpr_drake.analyses.queries import as_dict, polygon_figure, polygon_tensions, solve_all
from cdpr_drake.cli.numbers import parse_numbers
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models import load_robot, tension_problem
from cdpr_drake.spatial import pose_from_angles
from cdpr_drake.tensions import TensionSolution, distribute


def tension(
    robot: Annotated[str, typer.Argument(help="Robot by name, or path of a robot file.")],
    pose: Annotated[str, typer.Option(help="Platform, x,y,z [m] or x,y,z,phi,theta,psi [m, deg].")],
    method: Annotated[str, typer.Option(help="Method by name, or all.")] = "quadratic_program",
    wrench: Annotated[
        str | None,
        typer.Option(help="Wrench beside the weight, about Po in W: mx,my,mz,fx,fy,fz [N m, N]."),
    ] = None,
    limits: Annotated[
        str | None, typer.Option(help="Tension limits lo,hi [N] in the place of the robot's.")
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of the platform [kg].")] = None,
    reference: Annotated[
        float | None, typer.Option(help="Wanted tension of all cables [N], for reference_program.")
    ] = None,
    length_scale: Annotated[
        float | None,
        typer.Option(help="By which slack_relaxed divides moments to compare with forces [m]."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the feasible polygon with the methods' points.")
    ] = None,
) -> None:
    """Finds cable tensions that hold the platform at a pose, or proves that there are none."""
    loaded = load_robot(robot)
    numbers = parse_numbers("--pose", pose, (3, 6), "x,y,z [m] or x,y,z,phi,theta,psi [m, deg]")
    angles = numbers[3:] or [0.0, 0.0, 0.0]
    X_WP = pose_from_angles(np.array(numbers[:3]), np.radians(angles))
    external = None
    if wrench is not None:
        meaning = "mx,my,mz,fx,fy,fz [N m, N]"
        external = np.array(parse_numbers("--wrench", wrench, (6,), meaning))
    bounds = None
    if limits is not None:
        low, high = parse_numbers("--limits", limits, (2,), "lo,hi [N]")
        bounds = (low, high)
    wanted = None if reference is None else np.full(len(loaded.cables), reference)
    problem = tension_problem(loaded, X_WP, external, bounds, mass, wanted, length_scale)
    every = method == "all"
    solutions = solve_all(problem) if every else [distribute(problem, method)]
    if plot is not None:
        _save_plot(polygon_figure(problem, f"{loaded.name} at ({pose})"), plot)
    if as_json:
        found: dict[str, Any] = {"robot": loaded.name, "redundancy": problem.redundancy}
        if every:
            found["solutions"] = [as_dict(solution) for solution in solutions]
        else:
            found |= as_dict(solutions[0])
        if problem.redundancy == 2:
            found["polygon_vertices_n"] = polygon_tensions(problem)
        print(json.dumps(found, indent=2))
        return
    _print_table([cable.name for cable in loaded.cables], solutions)


def _save_plot(figure: Any, path: Path) -> None:
    try:
        save_figure(figure, path)
    except (OSError, ValueError) as problem:
        raise OutputFolderError(f"{path}: cannot be written: {problem}") from problem


def _print_table(cables: list[str], solutions: list[TensionSolution]) -> None:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True, title="Tensions [N]")
    table.add_column("method", no_wrap=True)
    table.add_column("status", no_wrap=True)
    for cable in cables:
        table.add_column(cable, justify="right", no_wrap=True)
    for solution in solutions:
        numbers = [f"{t:.2f}" if np.isfinite(t) else "-" for t in solution.tensions]
        table.add_row(solution.method, str(solution.status), *numbers)
    # A pipe has no width; there the table may be as wide as it needs.
    Console(width=None if sys.stdout.isatty() else 160).print(table)
