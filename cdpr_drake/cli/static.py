"""`cdpr static`: a robot or a mechanism at rest, at a pose or with given cable lengths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.front.mechanisms import hang_mechanism
from cdpr_drake.analyses.front.statics import solve_static
from cdpr_drake.analyses.statics.static_query import StaticReport
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import CABLE_MODELS, ELASTIC
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.mechanism_options import (
    Held,
    Joint,
    parse_joints,
    parse_names,
    print_rest,
    refuse_for_mechanisms,
    refuse_for_robots,
)
from cdpr_drake.cli.options import (
    POSE,
    AsJson,
    Pulleys,
    RobotName,
    check_plots,
    parse_limits,
    parse_numbers,
    pose_or_home,
    save_plot,
)
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.plant_rest import POSE as YIELDING_POSE
from cdpr_drake.models.plant_rest import PRESTRESS
from cdpr_drake.models.robot_loader import load_robot, names_mechanism


def static(
    robot: RobotName,
    pose: Annotated[str | None, POSE] = None,
    lengths: Annotated[
        str | None, typer.Option(help="Unstrained cable lengths from A to B, l1,...,lm [m].")
    ] = None,
    cable_model: Annotated[
        str | None,
        typer.Option(
            help="Cable model: " + ", ".join(CABLE_MODELS) + ". Default: the robot file's, or "
            "elastic.",
            autocompletion=words_among(CABLE_MODELS),
        ),
    ] = None,
    pulleys: Pulleys = True,
    joint: Joint = None,
    yields: Annotated[
        str | None,
        typer.Option(
            help="For a mechanism, what gives way: prestress (joints stay where they are) or "
            "pose (joints move until tensions are the prestress).",
            autocompletion=words_among((PRESTRESS, YIELDING_POSE)),
        ),
    ] = None,
    prestress: Annotated[
        str | None,
        typer.Option(help="For a mechanism: desired tensions, one for all or t1,...,tm [N]."),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(
            help="For a mechanism: joints that come to rest freely, a,b or none; default: those "
            "on which neither cables nor motors act."
        ),
    ] = None,
    held: Held = None,
    limits: Annotated[
        str | None,
        typer.Option(help="For a mechanism: tension limits lower,upper [N], instead of its own."),
    ] = None,
    as_json: AsJson = False,
    plot: Annotated[Path | None, typer.Option(help="Draw cables, tensions, frequencies.")] = None,
    plot_behaviour: Annotated[
        Path | None,
        typer.Option(
            help="Draw what the file says of stiffening, heat, creep, sheaves, hysteresis."
        ),
    ] = None,
) -> None:
    """Computes lengths, tensions, stiffness, vibrations and sag of a robot at rest.

    Tensions hold a mechanism at its home; with --lengths it comes to rest from there.
    """
    check_plots(plot, plot_behaviour)
    own = {
        "joint": joint, "yields": yields, "prestress": prestress, "free": free, "held": held,
        "limits": limits,
    }  # fmt: skip
    if names_mechanism(robot):
        refuse_for_mechanisms({"pose": pose, "plot_behaviour": plot_behaviour})
        mechanism = load_mechanism(robot)
        m = len(mechanism.cables)
        with working(message_console(), f"{mechanism.name} at rest"):
            at_rest = hang_mechanism(
                mechanism,
                parse_numbers("--lengths", lengths, (m,), f"{m} lengths [m]")
                if lengths is not None
                else None,
                joints=parse_joints(joint),
                model=cable_model or ELASTIC,
                pulleys=pulleys,
                yields=yields or PRESTRESS,
                free=parse_names(free),
                held=parse_names(held),
                prestress=_prestress(prestress, m),
                limits=parse_limits(limits),
            )
        if plot is not None:
            save_plot(at_rest.plot(), plot)
        if as_json:
            print_json(at_rest.as_dict())
        else:
            print_rest(at_rest)
        return
    refuse_for_robots(own)
    if pose is not None and lengths is not None:
        raise CdprError("--pose, --lengths: found both; accepted: one of them, or the home pose")
    loaded = load_robot(robot)
    given, X_WP = None, None
    if lengths is None:
        X_WP = pose_or_home(pose, loaded)
    else:
        m = len(loaded.cables)
        given = parse_numbers("--lengths", lengths, (m,), f"{m} lengths [m]")
    with working(message_console(), f"{loaded.name} at rest"):
        report = solve_static(loaded, X_WP, given, cable_model, pulleys)
    friction = loaded.cable_behaviour().sheave_friction
    if friction > 0.0 and not report.cables.has_pulleys():
        message_console().print(
            f"note: sheave_friction {friction:g} of {loaded.name} does nothing without pulleys"
        )
    if plot is not None:
        save_plot(report.plot(), plot)
    if plot_behaviour is not None:
        save_plot(report.plot_behaviour(loaded), plot_behaviour)
    if as_json:
        print_json(report.as_dict())
    else:
        _print(report)


def _prestress(words: str | None, m: int) -> Array | None:
    """Wanted tensions, shape (m,) [N]; raises as `parse_numbers`."""
    if words is None:
        return None
    values = parse_numbers("--prestress", words, (1, m), f"one number, or {m} of them [N]")
    return np.broadcast_to(np.array(values), (m,))


def _print(report: StaticReport) -> None:
    console = wide_console(120)
    p = report.X_WP.translation()
    angles = np.degrees(angles_from_rotation(report.X_WP.rotation()))
    console.print(
        f"{report.robot} at ({_words(p, 5)}) m, ({_words(angles, 4)}) deg: {report.stability}"
    )
    table = Table(box=SIMPLE_HEAD, title=f"Cables, {report.model}, {report.geometry}")
    for heading in ("cable", "length [m]", "unstrained [m]", "tension [N]", "sag [mm]"):
        table.add_column(heading, justify="right")
    table.add_column("surplus [mm]", justify="right")
    table.add_column("slack")
    for k, name in enumerate(report.names):
        table.add_row(
            name,
            f"{report.lengths[k]:.5f}",
            f"{report.l0[k]:.5f}",
            f"{report.tensions[k]:.2f}",
            f"{1e3 * report.sags[k]:.2f}",
            f"{1e3 * report.surplus_lengths[k]:.3f}" if report.surplus_lengths[k] > 0.0 else "-",
            "slack" if report.slack[k] else "",
        )
    console.print(table)
    if report.drums is not None:
        for words, row in zip(("wound up", "paid out"), report.drums, strict=True):
            told = ", ".join(f"{t:.2f}" for t in row)
            console.print(f"tensions at the drums while cable is {words} [N]: {told}")
    stiffness = ", ".join(f"{k:.3g}" if np.isfinite(k) else "rigid" for k in report.principal)
    console.print(f"principal stiffnesses [N/m], turns times {report.arm:.3g} m: {stiffness}")
    if report.frequencies is not None:
        words = ", ".join(f"{f:.4g}" if np.isfinite(f) else "unstable" for f in report.frequencies)
        console.print(f"natural frequencies [Hz]: {words}")
    if report.contacts is not None:
        within, *moments = report.contacts.tolist()
        held = ", ".join(f"{moment:.3g}" for moment in moments)
        console.print(
            f"rest is not unique: contacts hold moments up to ({held}) N m about x, y, z of P, so "
            f"that the platform may rest turned by up to {np.degrees(within):.3g} deg from here; "
            "frequencies are those of swings that slip, small swings are faster"
        )
    if report.others:
        console.print(f"other poses of rest that were found: {len(report.others)}, higher ones")


def _words(values: Array, digits: int) -> str:
    """Rounded to nanometres or less, so that no -0 is left."""
    return ", ".join(f"{round(value, 9) + 0.0:.{digits}g}" for value in values)
