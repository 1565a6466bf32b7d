"""`cdpr stability`: where a robot's visual servo is stable in spite of perturbations.

With --along it gives the stability criterion along a run that was made (`show_stability_along`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.front.stability import assess_stability, stability_question
from cdpr_drake.analyses.front.workspaces import default_box
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.simulation.stability_files import stability_of_folder
from cdpr_drake.analyses.workspaces.stability_results import KINDS, StabilityWorkspaces
from cdpr_drake.cli.completion import robot_words, scenario_words
from cdpr_drake.cli.grid_options import (
    GridSession,
    GridWords,
    Orientations,
    Out,
    Workers,
    check_mass,
    check_workers,
    default_folder,
    parse_grid,
    parse_turns,
)
from cdpr_drake.cli.options import (
    FigureFormats,
    Limits,
    Mass,
    Pulleys,
    ResultsAsJson,
    Scheduler,
    Wrench,
    named_options,
    parse_formats,
    parse_limits,
    parse_numbers,
    parse_wrench,
)
from cdpr_drake.cli.run_endings import report_failures
from cdpr_drake.cli.terminal import message_console, print_json, wide_console, working
from cdpr_drake.errors import CdprError, OutputFolderError, StoppedError, why_not_read
from cdpr_drake.stability.verdict import VerdictOptions


def show_stability_along(
    run: Path, threshold: float | None, out: Path | None, formats: Sequence[str], as_json: bool
) -> int:
    """Judges a run's log; writes and prints what was found.

    Args:
        run: Folder of the run.
        threshold: Tension from which a cable counts as taut [N]; None: one that is not slack.
        out: Where to write; None: into the run's folder.
        formats: Of the figure.
        as_json: Whether to print JSON.
    """
    if threshold is not None and not (math.isfinite(threshold) and threshold >= 0.0):
        raise CdprError(f"--threshold: found {threshold:g}; accepted: >= 0 [N]")
    folder = run if out is None else out
    with working(message_console(), f"{run}: reading the log") as say:
        found = stability_of_folder(run, threshold)
        say("Writing results")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            failed = found.write(folder, formats)
        except OSError as problem:
            raise OutputFolderError(
                f"{folder}: cannot be written: {why_not_read(problem)}"
            ) from problem
    numbers = found.as_dict()
    code = report_failures(message_console(), failed, folder, None)
    if as_json:
        print_json(numbers)
        return code
    margin, taut = numbers["least_stability_margin"], numbers["taut_cables"]
    table = Table(title=f"{run}: stability along the run", show_header=False)
    for label, words in (
        ("cables that pull", f"at least {taut['min']}, {taut['end']} at the end"),
        ("rank of the Jacobian", f"at least {numbers['least_jacobian_rank']}"),
        ("rank below " + str(numbers["freedom"]), f"{numbers['underactuated_s']:.2f} s"),
        ("least eigenvalue of sym(Pi)", "unknown" if margin is None else f"{margin:.3f}"),
        ("not stable", f"{numbers['unstable_s']:.2f} s"),
        ("results", str(folder)),
    ):
        table.add_row(label, words)
    wide_console().print(table)
    return code


def stability(
    context: typer.Context,
    robot: Annotated[
        str | None,
        typer.Argument(help="Robot by name, or path of a robot file.", autocompletion=robot_words),
    ] = None,
    scheme: Annotated[str, typer.Option(help="pbvs, pbvs-line, 2.5d or ibvs.")] = "pbvs",
    verdict: Annotated[str, typer.Option(help="sampled, searched or certified.")] = "searched",
    bounds: Annotated[
        Path | None,
        typer.Option(help="YAML file of perturbation bounds; without, the thesis' baseline."),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="One bound's values, such as r_A=0.005,0.01 [m] or d_theta_bp_deg=3,10; "
            "may be repeated."
        ),
    ] = None,
    grid: GridWords = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Scenario whose object, desired view and camera count; without, the task of the "
            "published workspaces: the opposite corner of the grid, half a turn away.",
            autocompletion=scenario_words,
        ),
    ] = None,
    printed_matrix: Annotated[
        bool,
        typer.Option(
            "--printed-matrix",
            help="Judge pbvs with the interaction matrix of the thesis' tables, instead of the "
            "exact one of the servo that cdpr simulate runs.",
        ),
    ] = False,
    orientation: Orientations = None,
    draws: Annotated[
        int, typer.Option(help="Random perturbations per pose, for all verdicts.")
    ] = VerdictOptions.draws,
    seed: Annotated[
        int, typer.Option(help="Seed of the perturbations, for all verdicts.")
    ] = VerdictOptions.seed,
    searches: Annotated[
        int,
        typer.Option(
            help="Local searches for the worst perturbation per pose; searched and certified."
        ),
    ] = VerdictOptions.searches,
    pieces: Annotated[
        int,
        typer.Option(
            help="Pieces of the perturbations that a certificate looks at, at most; more prove "
            "more, and take longer; certified only."
        ),
    ] = VerdictOptions.pieces,
    limits: Limits = None,
    mass: Mass = None,
    wrench: Wrench = None,
    pulleys: Pulleys = True,
    out: Out = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: ResultsAsJson = False,
    figure_format: FigureFormats = "png",
    along: Annotated[
        Path | None,
        typer.Option(help="Folder of a run: judges its poses instead, with slack cables left out."),
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            help="Tension from which a cable counts as taut [N]; without, one that is not slack; "
            "with --along only."
        ),
    ] = None,
) -> int:
    """Finds where a visual servo is stable (Z), the platform can be held (S), and both (SZ).

    The same command continues an interrupted one.
    """
    if along is not None:
        _refuse_beside_along(context)
        return show_stability_along(along, threshold, out, parse_formats(figure_format), as_json)
    if threshold is not None:
        raise CdprError("--threshold: accepted with --along only")
    if robot is None:
        raise CdprError("Missing argument 'robot'; see cdpr stability --help")
    check_workers(workers)
    check_mass(mass, zero=True)
    formats = parse_formats(figure_format)
    with named_options({f"scenario {scenario}": f"--scenario {scenario}"}):
        asked: dict[str, Any] = {
            "scheme": scheme, "verdict": verdict, "bounds": bounds, "vary": parse_vary(vary or []),
            "grid": parse_grid(grid, parse_turns(orientation or []), *default_box(robot)),
            "scenario": scenario, "printed_matrix": printed_matrix,
            "limits": parse_limits(limits), "mass": mass,
            "wrench": parse_wrench(wrench), "pulleys": pulleys,
            "options": VerdictOptions(draws=draws, seed=seed, searches=searches, pieces=pieces),
        }  # fmt: skip
        question = stability_question(robot, **asked)
        name = f"{question.robot}-{scheme}-{verdict}"
        folder = out if out is not None else default_folder("stability", name, question.arguments())
        with GridSession(folder, question.robot) as session:
            try:
                found = assess_stability(
                    robot, **asked, folder=folder, workers=scheduler or workers, formats=formats,
                    session=session,
                )  # fmt: skip
            except StoppedError:
                return session.interrupted()
    if as_json:
        print_json(found.as_dict())
    else:
        _print_table(found, folder)
    return report_failures(session.console, found.failed, shown_path(folder.resolve()), None)


BESIDE_ALONG = ("along", "threshold", "out", "as_json", "figure_format")
"""Options that go with --along."""


def _refuse_beside_along(context: typer.Context) -> None:
    """Refuses arguments that say nothing about a run that was made."""
    for name in context.params:
        source = context.get_parameter_source(name)
        if source is not None and source.name != "DEFAULT" and name not in BESIDE_ALONG:
            shown = "robot" if name == "robot" else f"--{name}"
            raise CdprError(
                f"--along: found beside {shown}; accepted with --threshold, --out, --json and "
                "--format only"
            )


def parse_vary(items: list[str]) -> dict[str, list[float]]:
    """Values of bounds from words such as r_A=0.005,0.01.

    Raises:
        CdprError: Not of that form, or not finite.
    """
    found: dict[str, list[float]] = {}
    for item in items:
        name, equals, values = item.partition("=")
        meaning = "name=value,value,..., as in r_A=0.005,0.01"
        if not equals or not name:
            raise CdprError(f"--vary: found {item!r}; accepted: {meaning}")
        count = values.count(",") + 1
        found.setdefault(name, []).extend(parse_numbers("--vary", values, (count,), meaning))
    return found


def _print_table(found: StabilityWorkspaces, folder: Path) -> None:
    about = found.arguments
    table = Table(
        title=f"{about['robot']}, {about['scheme']}, {about['verdict']}: cells inside",
        box=SIMPLE_HEAD,
        pad_edge=False,
    )
    table.add_column("bounds", no_wrap=True)
    for kind in KINDS:
        table.add_column(f"{kind} [%]", justify="right", no_wrap=True)
    unit = f"[{found.volume('Z').unit}]"
    for kind in ("Z", "SZ"):
        table.add_column(f"{kind} {unit}", justify="right", no_wrap=True)
    for name in found.names:
        volumes = {kind: found.volume(kind, bounds=name) for kind in KINDS}
        table.add_row(
            name,
            *(f"{100.0 * volumes[kind].share:.1f}" for kind in KINDS),
            *(f"{volumes[kind].value:.4g}" for kind in ("Z", "SZ")),
        )
    printer = wide_console()
    printer.print(table)
    for kind, words in KINDS.items():
        printer.print(f"{kind}: {words}", highlight=False)
    printer.print(f"cables: {found.geometry}", markup=False)
    if found.interaction_matrix:
        printer.print(f"interaction matrix: {found.interaction_matrix}", markup=False)
    printer.print(f"results: {folder}", soft_wrap=True, highlight=False)
