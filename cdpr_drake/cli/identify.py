"""`cdpr identify`: finds a robot's dynamics in a log of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.calibration import read_log, shifted_log
from cdpr_drake.analyses.identification import (
    CAMPAIGN_UNKNOWN,
    UNKNOWN,
    IdentificationTask,
    run_dynamic_campaign,
    tracking_table,
    write_dynamic_campaign,
)
from cdpr_drake.analyses.identification import identification_dict as as_dict
from cdpr_drake.analyses.identification import identification_tables as tables
from cdpr_drake.analyses.identification import identify as run_identification
from cdpr_drake.analyses.identification import write_identification as write
from cdpr_drake.analyses.reporting import free_folder, results_folder
from cdpr_drake.cli.completion import robot_words
from cdpr_drake.cli.endings import shown_path
from cdpr_drake.cli.options import (
    FigureFormats,
    Overwrite,
    ResultsAsJson,
    named_values,
    parse_formats,
)
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError
from cdpr_drake.identification import GROUPS
from cdpr_drake.models import load_robot
from cdpr_drake.systems.diagrams import load_scenario
from cdpr_drake.systems.scenarios import TensionScenario


def help_words() -> str:
    """What `cdpr identify --help` says above the options."""
    return (
        "Finds a robot's dynamics in a log of a motion.\n\n"
        "A row of LOG is an instant, as in the log.csv of cdpr simulate. Columns: time_s; the pose "
        "by a tracker, x_m, y_m, z_m with qw, qx, qy, qz or angles; C1_tension_n ...; for "
        "stiffness and damping what winches count, C1_length_m or C1_motor_angle_rad; for friction "
        "also C1_motor_torque_nm. Cables go by name or number, units by ending; of true and "
        "measured values the measured ones are read.\n\n"
        f"--unknown: {', '.join(GROUPS)}. Writes robot.yaml, which scenarios take as "
        "perturbations.believed_robot, identification.json and figures. The exit code is 2 where "
        "the log cannot tell what is asked."
    )


def identify(
    robot: Annotated[
        str | None,
        typer.Argument(
            help="Robot by name, or path of a robot file.",
            autocompletion=robot_words,
            show_default=False,
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Argument(help="Log, text with columns.", metavar="LOG", show_default=False),
    ] = None,
    validate: Annotated[
        Path | None,
        typer.Option(help="Log of another motion, which is predicted and not fitted."),
    ] = None,
    unknown: Annotated[
        str | None,
        typer.Option(
            help="Groups of parameters, with commas; else mass,center_of_mass,inertia, of a "
            "campaign also stiffness,friction,static_friction."
        ),
    ] = None,
    common: Annotated[
        str, typer.Option(help="Groups that are one for all cables or winches, with commas.")
    ] = "",
    prior: Annotated[
        str | None,
        typer.Option(help="Standard deviations known beforehand, as mass=0.1,inertia=0.01."),
    ] = None,
    bandwidth: Annotated[
        float | None,
        typer.Option(help="Of the smoothing [Hz]; else 8, less for slow logs."),
    ] = None,
    sigma_lengths: Annotated[
        float, typer.Option(help="Of lengths that winches count, with geometry [m].")
    ] = 5e-5,
    pulleys: Annotated[
        bool, typer.Option("--pulleys/--no-pulleys", help="Whether cables run over pulleys.")
    ] = True,
    tracker_late: Annotated[
        float | None, typer.Option(help="By how much the tracker's poses are late [s].")
    ] = None,
    campaign: Annotated[
        str | None,
        typer.Option(
            help="Scenario of dynamic control, in the place of robot and log: its robot with an "
            "unknown payload follows the excitation that tells most, is identified, and follows "
            "the scenario's own motion again."
        ),
    ] = None,
    keep_outliers: Annotated[bool, typer.Option(help="Count every equation as it is.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Results folder; without it, a new one below runs/.")
    ] = None,
    as_json: ResultsAsJson = False,
    overwrite: Overwrite = False,
    figure_format: FigureFormats = "png",
) -> None:
    """Finds a robot's dynamics in a log of a motion."""
    formats = parse_formats(figure_format)
    if campaign is not None:
        if robot is not None or log is not None:
            raise CdprError(
                f"--campaign: found beside {log or robot}; accepted: without robot, log"
            )
        asked = CAMPAIGN_UNKNOWN if unknown is None else _words(unknown)
        _campaign(campaign, asked, out, (as_json, overwrite, formats))
        return
    if robot is None or log is None:
        raise CdprError("identify: found no robot or no log; accepted: both, or --campaign")
    loaded = load_robot(robot)
    names = [cable.name for cable in loaded.cables]
    read = read_log(log, names)
    other = None if validate is None else read_log(validate, names)
    if tracker_late is not None:
        read = shifted_log(read, tracker_late)
        other = None if other is None else shifted_log(other, tracker_late)
    task = IdentificationTask(
        robot=loaded, unknown=UNKNOWN if unknown is None else _words(unknown),
        common=_words(common),
        priors=named_values("--prior", prior), bandwidth=bandwidth, sigma_lengths=sigma_lengths,
        pulleys=pulleys, outliers=not keep_outliers, check_clock=tracker_late is None,
    )  # fmt: skip
    folder = out if out is not None else free_folder(Path("runs") / f"identify-{loaded.name}")
    with results_folder(folder, overwrite) as results:
        with working(message_console(), f"Identifying {loaded.name}") as say:
            found = run_identification(task, read, other, say)
            write(found, results.path, formats)
        folder = shown_path(results.publish())
    if as_json:
        print_json(as_dict(found))
        return
    printer = wide_console(140)
    for table in tables(found):
        printer.print(table)
    printer.print(f"results: {folder}")


def _campaign(
    name: str,
    unknown: tuple[str, ...],
    out: Path | None,
    how: tuple[bool, bool, tuple[str, ...]],
) -> None:
    """Runs a campaign with the robot of a scenario."""
    as_json, overwrite, formats = how
    scenario = load_scenario(name)
    if not isinstance(scenario, TensionScenario):
        raise CdprError(
            f"--campaign: found {name}, a {scenario.kind}; accepted: a scenario of tension_control"
        )
    folder = out if out is not None else free_folder(Path("runs") / f"identify-{scenario.name}")
    with results_folder(folder, overwrite) as results:
        with working(message_console(), f"Campaign of {scenario.name}") as say:
            run = run_dynamic_campaign(scenario, unknown, say)
            write_dynamic_campaign(run, results.path, formats)
        folder = shown_path(results.publish())
    found = run.identification
    if as_json:
        print_json(as_dict(found, run.as_dict(), run.truth))
        return
    printer = wide_console(140)
    for table in (*tables(found, run.truth), tracking_table(run)):
        printer.print(table)
    printer.print(f"results: {folder}")


def _words(option: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in option.split(",") if word.strip())
