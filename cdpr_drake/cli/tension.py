"""`cdpr tension`: distributes the platform's weight over the cables at one pose."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.front.tensions import (
    UNDERACTUATED,
    TensionsAtPose,
    UnderactuatedTensions,
    compare_tensions,
    solve_tensions,
)
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.mechanism_options import (
    Held,
    Joint,
    parse_joints,
    parse_names,
    print_tensions,
    refuse_for_mechanisms,
    refuse_for_robots,
)
from cdpr_drake.cli.options import (
    POSE,
    AsJson,
    Limits,
    Mass,
    Pulleys,
    RobotName,
    Wrench,
    check_plots,
    parse_limits,
    parse_numbers,
    parse_wrench,
    pose_or_home,
    save_plot,
)
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import load_robot, names_mechanism
from cdpr_drake.tensions.methods import METHODS


def tension(
    robot: RobotName,
    pose: Annotated[str | None, POSE] = None,
    method: Annotated[
        str,
        typer.Option(
            help="Tension distribution method by name, or all.",
            autocompletion=words_among([*METHODS, "all"]),
        ),
    ] = "quadratic_program",
    wrench: Wrench = None,
    force: Annotated[
        str | None,
        typer.Option(help="Instead of --wrench: force on the platform in Po, in W: fx,fy,fz [N]."),
    ] = None,
    moment: Annotated[
        str | None,
        typer.Option(help="Instead of --wrench: moment on the platform in W: mx,my,mz [N m]."),
    ] = None,
    pulleys: Pulleys = True,
    limits: Limits = None,
    mass: Mass = None,
    reference: Annotated[
        float | None, typer.Option(help="Desired tension of all cables [N], for reference_program.")
    ] = None,
    length_scale: Annotated[
        float | None,
        typer.Option(help="Length by which slack_relaxed and log_barrier divide moments [m]."),
    ] = None,
    joint: Joint = None,
    held: Held = None,
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

    For a mechanism: tensions at its home, on the joints that no motor holds.

    With fewer cables than degrees of freedom: the combinations of the wrench's components that
    cables cannot change, and the tensions if nothing stays unbalanced.

    The exit code is 0 for every answer, also `infeasible` and `missed`: read `status` in the table
    or with --json. It is 2 if the input is not accepted.
    """
    check_plots(plot, wrench_set_plot)
    if names_mechanism(robot):
        refuse_for_mechanisms({
            "pose": pose, "wrench": wrench, "mass": mass, "force": force, "moment": moment,
            "wrench-set-plot": wrench_set_plot,
        })  # fmt: skip
        from cdpr_drake.analyses.front.mechanisms import solve_mechanism_tensions
        from cdpr_drake.models.mechanism_loader import load_mechanism

        mechanism = load_mechanism(robot)
        with working(message_console(), f"Distributing tensions of {mechanism.name}"):
            tensions = solve_mechanism_tensions(
                mechanism, method, joints=parse_joints(joint), held=parse_names(held),
                pulleys=pulleys, limits=parse_limits(limits), reference=reference,
                length_scale=length_scale,
            )  # fmt: skip
        if plot is not None:
            save_plot(tensions.plot(), plot)
        if as_json:
            print_json(tensions.as_dict())
        else:
            print_tensions(tensions)
        return
    refuse_for_robots({"joint": joint, "held": held})
    loaded = load_robot(robot)
    X_WP, external, bounds = pose_or_home(pose, loaded), parse_wrench(wrench), parse_limits(limits)
    if external is not None and (force is not None or moment is not None):
        other = "--moment" if force is None else "--force"
        raise CdprError(f"--wrench: found {other} too; accepted: --wrench, or --force and --moment")
    asked: dict[str, Any] = {
        "force": None if force is None else parse_numbers("--force", force, (3,), "fx,fy,fz [N]"),
        "moment": None
        if moment is None
        else parse_numbers("--moment", moment, (3,), "mx,my,mz [N m]"),
        "pulleys": pulleys, "limits": bounds, "mass": mass, "reference": reference,
        "length_scale": length_scale,
    }  # fmt: skip
    cables = [cable.name for cable in loaded.cables]
    every = method == "all"
    if loaded.is_underactuated():
        for option, given in (("plot", plot), ("wrench-set-plot", wrench_set_plot)):
            if given is not None:
                raise CdprError(
                    f"--{option}: found {loaded.name} with {len(cables)} cables for "
                    f"{loaded.motion_type().freedom} degrees of freedom; accepted: at least as many"
                )
        every, method = False, UNDERACTUATED if every else method
    found: TensionsAtPose | UnderactuatedTensions
    with working(message_console(), f"Distributing tensions of {loaded.name}"):
        if every:
            found = compare_tensions(loaded, X_WP, external, **asked)
        else:
            found = solve_tensions(loaded, X_WP, external, method, **asked)
    if plot is not None and isinstance(found, TensionsAtPose):
        save_plot(found.plot_polygon(), plot)
    if wrench_set_plot is not None and isinstance(found, TensionsAtPose):
        save_plot(found.plot_wrenches(), wrench_set_plot)
    if as_json:
        print_json(found.as_dict())
    elif isinstance(found, TensionsAtPose):
        _print_table(cables, found)
    else:
        _print_underactuated(cables, found)


def _print_underactuated(cables: list[str], found: UnderactuatedTensions) -> None:
    console, answer = wide_console(120), found.as_dict()
    console.print(
        f"{answer['robot']}: {len(cables)} cables for {answer['degrees_of_freedom']} degrees of "
        f"freedom, which control {answer['rank']} of them here: {answer['status']}; "
        f"{found.geometry}"
    )
    if answer["tensions_n"] is not None:
        pairs = zip(cables, answer["tensions_n"], strict=True)
        console.print("tensions [N]: " + ", ".join(f"{name} {t:.2f}" for name, t in pairs))
    console.print("no tensions change, and at rest all of these are zero:")
    for one in answer["uncontrolled"]:
        console.print(f"  {one['combination']}: {one['unbalanced']:.4g}")
    for label, words in found.shortfall_rows():
        console.print(f"{label}: {words}")


def _print_table(cables: list[str], found: TensionsAtPose) -> None:
    title = f"Tensions [N], {found.geometry}"
    table = Table(box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True, title=title)
    table.add_column("method", no_wrap=True)
    table.add_column("status", no_wrap=True)
    for cable in cables:
        table.add_column(cable, justify="right", no_wrap=True)
    for solution in found.solutions:
        numbers = [f"{t:.2f}" if np.isfinite(t) else "-" for t in solution.tensions]
        table.add_row(solution.method, str(solution.status), *numbers)
    console = wide_console(160)
    console.print(table)
    rows, wrench = found.robot.motion_type().words(), found.problem.wrench
    load = ", ".join(
        f"{name} {value:.4g}" for name, value in zip(rows, wrench, strict=True) if value != 0.0
    )
    console.print(f"wrench to balance, about Po in W [N m, N]: {load or 'none'}")
    for label, words in found.shortfall_rows():
        console.print(f"{label}: {words}")
