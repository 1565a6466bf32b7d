"""`cdpr tension`: distributes the platform's weight over the cables at one pose."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.statics.tension_query import (
    as_dict,
    polygon_tensions,
    solve_all,
    underactuated_answer,
)
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import (
    POSE,
    AsJson,
    Limits,
    Mass,
    RobotName,
    Wrench,
    parse_limits,
    parse_pose,
    parse_wrench,
    save_plot,
)
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem, wrench_balance
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.tensions.problem import TensionSolution
from cdpr_drake.workspaces.available_wrenches import available_wrenches


def tension(
    robot: RobotName,
    pose: Annotated[str, POSE],
    method: Annotated[
        str,
        typer.Option(help="Method by name, or all.", autocompletion=words_among([*METHODS, "all"])),
    ] = "quadratic_program",
    wrench: Wrench = None,
    limits: Limits = None,
    mass: Mass = None,
    reference: Annotated[
        float | None, typer.Option(help="Wanted tension of all cables [N], for reference_program.")
    ] = None,
    length_scale: Annotated[
        float | None,
        typer.Option(help="By which slack_relaxed and log_barrier divide moments [m]."),
    ] = None,
    as_json: AsJson = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the feasible polygon with the methods' points.")
    ] = None,
    wrench_set_plot: Annotated[
        Path | None,
        typer.Option(help="Draw sections of the wrenches that the cables can give at the pose."),
    ] = None,
) -> None:
    """Finds cable tensions that hold the platform at a pose, or proves that there are none.

    With fewer cables than degrees of freedom: which combinations of the wrench's components the
    cables cannot change, and tensions where nothing is left unbalanced.

    The exit code is 0 for every answer, `infeasible` and `missed` included: read `status` in the
    table or with --json. It is 2 where the question is not accepted.
    """
    loaded = load_robot(robot)
    X_WP, external, bounds = parse_pose(pose), parse_wrench(wrench), parse_limits(limits)
    if loaded.is_underactuated():
        for option, given in (("plot", plot), ("wrench-set-plot", wrench_set_plot)):
            if given is not None:
                raise CdprError(
                    f"--{option}: found {loaded.name} with {len(loaded.cables)} cables for "
                    f"{loaded.motion_type().freedom} degrees of freedom; accepted: at least as many"
                )
        if method not in ("quadratic_program", "all"):
            raise CdprError(
                f"--method: found {method} for fewer cables than degrees of freedom of "
                f"{loaded.name}; accepted: quadratic_program"
            )
        balance = wrench_balance(
            loaded, X_WP, external, limits=bounds, mass=mass, length_scale=length_scale
        )
        answer = underactuated_answer(loaded, balance)
        if as_json:
            print_json(answer)
        else:
            _print_underactuated([cable.name for cable in loaded.cables], answer)
        return
    wanted = None if reference is None else np.full(len(loaded.cables), reference)
    problem = tension_problem(
        loaded,
        X_WP,
        external,
        limits=bounds,
        mass=mass,
        reference=wanted,
        length_scale=length_scale,
    )
    every = method == "all"
    with working(message_console(), f"Distributing tensions of {loaded.name}"):
        solutions = solve_all(problem) if every else [distribute(problem, method)]
    if plot is not None:
        from cdpr_drake.analyses.statics.static_figures import polygon_figure

        save_plot(polygon_figure(problem, f"{loaded.name} at ({pose})"), plot)
    if wrench_set_plot is not None:
        from cdpr_drake.analyses.workspaces.workspace_figures import wrench_set_figure

        wrenches = available_wrenches(problem.W, problem.lower, problem.upper, problem.row_scale)
        title = f"{loaded.name} at ({pose}): what the cables can give"
        save_plot(wrench_set_figure(wrenches, -problem.wrench, title), wrench_set_plot)
    if as_json:
        found: dict[str, Any] = {"robot": loaded.name, "redundancy": problem.redundancy}
        if every:
            found["solutions"] = [as_dict(solution) for solution in solutions]
        else:
            found |= as_dict(solutions[0])
        if problem.redundancy == 2:
            found["polygon_vertices_n"] = polygon_tensions(problem)
        print_json(found)
        return
    _print_table([cable.name for cable in loaded.cables], solutions)


def _print_underactuated(cables: list[str], answer: dict[str, Any]) -> None:
    console = wide_console(120)
    console.print(
        f"{answer['robot']}: {len(cables)} cables for {answer['degrees_of_freedom']} degrees of "
        f"freedom, which control {answer['rank']} of them here: {answer['status']}"
    )
    if answer["tensions_n"] is not None:
        pairs = zip(cables, answer["tensions_n"], strict=True)
        console.print("tensions [N]: " + ", ".join(f"{name} {t:.2f}" for name, t in pairs))
    console.print("no tensions change, and at rest all of these are zero:")
    for one in answer["uncontrolled"]:
        console.print(f"  {one['combination']}: {one['unbalanced']:.4g}")


def _print_table(cables: list[str], solutions: list[TensionSolution]) -> None:
    table = Table(box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True, title="Tensions [N]")
    table.add_column("method", no_wrap=True)
    table.add_column("status", no_wrap=True)
    for cable in cables:
        table.add_column(cable, justify="right", no_wrap=True)
    for solution in solutions:
        numbers = [f"{t:.2f}" if np.isfinite(t) else "-" for t in solution.tensions]
        table.add_row(solution.method, str(solution.status), *numbers)
    wide_console(160).print(table)
