"""Dynamics of a robot from a log of its platform that swings on standing winches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.fits.fit import (
    Fit,
    Unknown,
    fitted_robot,
    group_names,
    kept_fit,
    log_of,
    notes_table,
)
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    OutFolder,
    PoseWord,
    RobotWord,
    Switch,
    comma_words,
    named_values,
    words,
)
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError, accepted_names
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.identification.parameters import AXES, SIX
from cdpr_drake.identification.swing_log import SwingLog
from cdpr_drake.identification.swing_model import (
    CREEP,
    HYSTERESIS,
    STIFFENING,
    SwingingRobot,
)
from cdpr_drake.identification.swing_prediction import PULL, PULLED, PredictedStretch
from cdpr_drake.identification.swings import (
    SwingFit,
    SwingSigmas,
    SwingTask,
    fit_swings,
)
from cdpr_drake.models.cable_schema import BehaviourSettings, OwnMaterial
from cdpr_drake.models.platform_schema import HysteresisSettings
from cdpr_drake.models.robot_dynamics import dynamic_model, platform_size
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose, rigid_platform

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FARTHEST = 1e12
"""Largest time of a log [s]."""

LARGE = 0.3
"""Turns about an axis have a dominant frequency if their size is at least this share of the
largest."""

FINENESS = 16
"""Points of the grid of frequencies per point of the stretch's spectrum."""


def _spans(word: str) -> tuple[tuple[float, float], ...]:
    """Stretches of a log, of first:last with commas."""
    spans = []
    for item in filter(None, map(str.strip, word.split(","))):
        first, last = map(float, item.split(":"))
        if not -FARTHEST < first < last < FARTHEST:
            raise ValueError(word)
        spans.append((first, last))
    return tuple(spans)


Spans = Annotated[
    Sequence[tuple[float, float]],
    words(_spans, "first:last, the first below the last, as 20:24.5 [s], or several with commas",
          "FIRST:LAST,..."),
]  # fmt: skip


@verb()
def identify_swings(
    robot: RobotWord, log: InputFile, *, stretches: Spans = (), hold_out: Spans = (),
    unknown: Annotated[str | Sequence[str] | None, comma_words()] = None,
    priors: Annotated[Mapping[str, float] | None, named_values(name="--prior")] = None,
    sigmas: Annotated[Mapping[str, float] | None, named_values(name="--sigma")] = None,
    start: PoseWord = None, lead: float = 1.0, tracker_frame: Switch = False,
    folder: OutFolder = None, overwrite: Switch = False, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Fit:  # fmt: skip
    """Finds a robot's dynamics in a log of a platform that swings on standing winches.

    The platform was pushed, such as one with fewer cables than degrees of freedom, and nothing but
    cables and weight acts on it. Its whole motion is predicted from its state at the beginning of
    each stretch. Columns: time_s; poses by a tracker, or roll, pitch and yaw; C1_tension_n ...,
    without which the mass cannot be determined.

    The exit code is 2 if the log cannot tell what is unknown, and 6 if residuals are more than 3
    times the stated deviations: status misfit.

    Args:
        robot: Robot by name or file, as it is believed.
        log: Log, text with columns.
        stretches: Stretches to fit, as 44.6:49.2,32:36 [s]; default: the first half of the log.
        hold_out: Stretches to predict and not to fit, as 20:24 [s]; default: the second half of the
            log, if no stretches are named.
        unknown: Groups of parameters: mass, center_of_mass, inertia, stiffness, damping, of which
            all that the log can tell are the default; hysteresis, stiffening, creep, load_cells,
            load_cell_zeros.
        priors: Standard deviations known beforehand, as mass=0.1 [kg].
        sigmas: Standard deviations of the log, as turn=0.0175,position=0.003,tension=5 [rad, m, N].
        start: Pose near which the platform hangs [m, deg]; default: it is searched for.
        lead: First part of a held-out stretch, from which its initial state is estimated [s].
        tracker_frame: Poses are measured in an unknown frame, which is identified too.
        folder: Results folder with robot.yaml, which scenarios take as
            perturbations.believed_robot, results.json and figures; default:
            runs/identify-swings-ROBOT; in Python nothing is kept.
        overwrite: Replace results in the folder.
        formats: Formats of the figures.
        follow: Who follows the work.

    Raises:
        IdentificationError: The log does not hold, or does not tell, what is unknown; names it.
        DataFileError: A file cannot be read.
        OutputFolderError: The folder holds other results or files, or cannot be written.
    """
    loaded = as_robot(robot, "identify_swings")
    if not 0.0 < lead < math.inf:
        raise IdentificationError(f"lead: found {lead:g}; accepted: > 0 [s]")
    deviations = _sigmas(sigmas or {})
    measured = log_of(loaded, log)
    task = SwingTask(
        robot=swinging_robot(loaded), stretches=tuple(stretches), held_out=tuple(hold_out),
        sigmas=deviations, unknown=None if unknown is None else group_names(unknown),
        start=None if start is None else as_pose(loaded, start), tracker=tracker_frame, lead=lead,
        priors=dict(priors or {}),
    )  # fmt: skip
    arguments = {
        "robot": loaded, "log": measured, "unknown": task.unknown,
        "stretches": task.stretches, "hold_out": task.held_out, "priors": task.priors,
        "sigmas": asdict(deviations), "lead": lead, "tracker_frame": tracker_frame,
        "start": None if task.start is None else task.start.GetAsMatrix34().tolist(),
    }  # fmt: skip

    def work() -> Fit:
        follow.doing(f"Identifying {loaded.name}")
        return swings_fit(loaded, fit_swings(task, swing_log(loaded, measured), follow.doing))

    name = f"identify-swings-{loaded.name}"
    return kept_fit(name, arguments, work, folder, overwrite, formats, follow)


def swinging_robot(robot: Robot) -> SwingingRobot:
    """A robot as the mathematics takes it.

    Raises:
        IdentificationError: Its platform does not move freely in space.
    """
    return SwingingRobot(
        name=robot.name, dynamics=dynamic_model(robot), platform=rigid_platform(robot),
        cables=robot.cable_set(), home=robot.home.transform(), size=platform_size(robot),
        contacts=(robot.platform.hysteresis or HysteresisSettings()).contacts(),
    )  # fmt: skip


def swing_log(robot: Robot, log: Measurements) -> SwingLog:
    """A robot's log as the mathematics takes it.

    Raises:
        IdentificationError: The log has no times, or neither poses nor turns.
    """
    if log.time is None:
        raise IdentificationError(f"{log.path}: time: found none; accepted: a column time_s")
    if log.poses is not None:
        rows = np.array([np.full(7, np.nan) if X is None else pose_row(X) for X in log.poses])
    elif log.tilts is not None:
        rows, complete = np.full((log.count, 4), np.nan), np.isfinite(log.tilts).all(axis=1)
        turns = Rotation.from_euler("ZYX", log.tilts[complete][:, ::-1])
        rows[complete] = turns.as_quat()[:, [3, 0, 1, 2]]
    else:
        raise IdentificationError(
            f"{log.path}: turns: found none; accepted of a free motion: poses, or roll, pitch and "
            "yaw"
        )
    return SwingLog.of(str(log.path), log.time, rows, log.tensions, log.wound(robot))


def _sigmas(values: Mapping[str, float]) -> SwingSigmas:
    names = [field.name for field in fields(SwingSigmas)]
    for name, value in values.items():
        if name not in names:
            raise IdentificationError(f"sigmas: found {name!r}; {accepted_names(name, names)}")
        if not 0.0 < value < math.inf:
            raise IdentificationError(f"sigmas: {name}: found {value:g}; accepted: > 0")
    return SwingSigmas(**values)


def swings_fit(robot: Robot, motion: SwingFit) -> Fit:
    """The fit to a log of swings, with its robot, tables and figures."""
    task, tracked = motion.task, motion.log.positions is not None
    fitted, held_out = (
        [_stretch_numbers(stretch) for stretch in stretches]
        for stretches in (motion.fitted, motion.held_out)
    )
    unknowns = tuple(
        Unknown(u.name, u.unit, float(std), value=float(value), before=u.before)
        for u, value, std in zip(motion.unknowns, motion.values, motion.std, strict=True)
    )
    drawings = {}
    if motion.held_out:
        title = "held out: predicted behind the dashed line"
        drawings["held_out"] = lambda: _turns_figure(motion, motion.held_out, title)
    drawings["fitted"] = lambda: _turns_figure(motion, motion.fitted, "fitted")
    if any(each.unexplained is not None for each in (*motion.fitted, *motion.held_out)):
        drawings["unexplained"] = lambda: _unexplained_figure(motion)
    return Fit(
        title=f"Free motion of {robot.name}", model=swung_robot(robot, motion),
        status=motion.status, unknowns=unknowns, spread=motion.spread, held_out=held_out,
        remarks=motion.remarks,
        details=finite({
            "robot": robot.name, "log": motion.log.name, "method": "free motion",
            "correlation_instants": motion.correlation_time,
            "sigmas": {
                "turn_rad": task.sigmas.turn, "position_m": task.sigmas.position,
                "tension_n": task.sigmas.tension,
            },
            "priors": dict(task.priors),
            "positions": "measured" if tracked else "by measured turns and cable lengths",
            "fitted": fitted, "held_out": held_out, "modes_hz": motion.modes[0].tolist(),
            "modes_before_hz": motion.modes[1].tolist(), "steps": motion.steps,
            "wall_time_s": motion.wall_time,
        }),
        shown=tuple(_tables(motion, unknowns, fitted, held_out)), drawings=drawings,
        result=motion,
    )  # fmt: skip


def dominant_frequency(time: Array, values: Array) -> float:
    """Where the spectrum of even samples is largest [Hz], by Hann's window and a parabola.

    Args:
        time: Shape (n,) [s].
        values: Shape (n,).
    """
    n, step = len(time), float(time[1] - time[0])
    window = np.hanning(n)
    middle = float(np.sum(window * values) / np.sum(window))
    power = np.abs(np.fft.rfft((values - middle) * window, FINENESS * n))
    frequencies = np.fft.rfftfreq(FINENESS * n, step)
    inside = np.flatnonzero(frequencies >= 1.0 / (n * step))
    k = int(inside[np.argmax(power[inside])])
    if not 0 < k < len(power) - 1:
        return float(frequencies[k])
    a, b, c = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    shift = 0.5 * (a - c) / (a - 2.0 * b + c) if a - 2.0 * b + c != 0.0 else 0.0
    return float(frequencies[k] + shift * frequencies[1])


def _axis_frequencies(stretch: PredictedStretch) -> list[dict[str, Any]]:
    """Measured and predicted frequencies of `LARGE` turns, behind the lead of a stretch."""
    rows = stretch.after_lead()
    time, sizes = stretch.stretch.time[rows], np.std(stretch.measured_turns[rows], axis=0)
    frequencies = []
    for k in np.flatnonzero(sizes >= LARGE * np.max(sizes)):
        measured = dominant_frequency(time, stretch.measured_turns[rows, k])
        predicted = dominant_frequency(time, stretch.predicted_turns[rows, k])
        frequencies.append({
            "axis": "xyz"[k], "measured_hz": measured, "predicted_hz": predicted,
            "off": predicted / measured - 1.0,
        })  # fmt: skip
    return frequencies


def _stretch_numbers(stretch: PredictedStretch) -> dict[str, Any]:
    """Numbers of a stretch for JSON; `unexplained` is what neither cables nor weight explain."""
    time, rest, largest = stretch.stretch.time, stretch.unexplained, None
    if rest is not None:
        (force, force_at), (moment, moment_at) = map(rest.largest, (rest.force, rest.moment))
        largest = {
            "force_n": force, "force_at_s": force_at, "moment_nm": moment,
            "moment_at_s": moment_at, "mean_over_s": PULL,
        }  # fmt: skip
    return {
        "from_s": float(time[0]), "until_s": float(time[-1]),
        "state_from_first_s": finite(stretch.lead), "turn_rms_rad": stretch.turn_rms(),
        "position_rms_m": stretch.position_rms(), "tension_rms_n": stretch.tension_rms(),
        "frequencies": _axis_frequencies(stretch), "unexplained": largest,
    }  # fmt: skip


def _tables(
    motion: SwingFit, unknowns: Sequence[Unknown], fitted: Sequence[dict[str, Any]],
    held_out: Sequence[dict[str, Any]],
) -> list[Table]:  # fmt: skip
    """Parameters, predictions of stretches, modes, remarks."""
    rows = []
    for title, stretches in (("fitted", fitted), ("held out", held_out)):
        for numbers in stretches:
            place, tension = numbers["position_rms_m"], numbers["tension_rms_n"]
            lead, rest = numbers["state_from_first_s"], numbers["unexplained"]
            state = "" if title == "fitted" else f", state from the first {lead or math.inf:g} s"
            rows.append((
                f"{title} {numbers['from_s']:.6g}:{numbers['until_s']:.6g}{state}",
                f"{np.degrees(numbers['turn_rms_rad']):.3g}",
                "" if place is None else f"{1e3 * place:.3g}",
                "" if tension is None else f"{tension:.3g}",
                "" if rest is None else f"{rest['force_n']:.3g}",
                ", ".join(
                    f"{f['axis']} {f['measured_hz']:.3f}, predicted {f['predicted_hz']:.3f}"
                    for f in numbers["frequencies"]
                ),
            ))  # fmt: skip
    modes = zip(("identified", "as believed before"), motion.modes, strict=True)
    return [
        Table(
            f"Free motion of {motion.task.robot.name}: {motion.status}, residuals "
            f"{motion.spread:.2f} sigma",
            ("fitted parameter", "before", "value", "std. error", "unit"),
            [(u.name, f"{u.before:.5g}", f"{u.value:.5g}", f"{u.std:.2g}", u.unit)
             for u in unknowns],
        ),
        Table("Predicted beside measured", (
            "stretch [s]", "turn rms [deg]", "position rms [mm]", "tension rms [N]",
            "unexplained [N]", "frequencies [Hz]",
        ), rows),
        Table("Modes about rest [Hz]", ("robot", *"123456"), [
            (title, *(f"{frequency:.3f}" for frequency in row)) for title, row in modes
        ]),
        *notes_table(motion.remarks),
    ]  # fmt: skip


def swung_robot(robot: Robot, motion: SwingFit) -> Robot:
    """The robot with its identified dynamics."""
    values = motion.model.by_name(motion.values)
    groups = {unknown.group for unknown in motion.unknowns}
    platform = replace(
        robot.platform, mass=values["mass"],
        center_of_mass=np.array([values[f"center_of_mass.{a}"] for a in AXES]),
        inertia=np.array([values[f"inertia.{ab}"] for ab in SIX]),
    )  # fmt: skip
    if HYSTERESIS in groups:
        rubbing = HysteresisSettings(**{
            name: values[f"hysteresis.{name}"] for name in ("tilt", "turn", "slip")
        })  # fmt: skip
        rubs = rubbing.contacts().is_there()
        platform = replace(platform, hysteresis=rubbing if rubs else None)
    share, cables = values["all.stiffness"] / float(np.mean(robot.cable_set().stiffness)), []
    for cable, material in zip(robot.cables, robot.materials(), strict=True):
        own = cable.material or OwnMaterial()
        if "stiffness" in groups:
            own = replace(own, youngs_modulus=material.youngs_modulus * share)
        if "damping" in groups:
            own = replace(own, retardation_time=values["all.retardation_time"])
        cables.append(replace(cable, material=own))
    material = robot.cable
    if groups & {STIFFENING, CREEP}:
        law = motion.model.behaviour(motion.values)
        behaviour = replace(
            material.behaviour or BehaviourSettings(), stiffening=law.stiffening,
            creep_stiffness=law.creep_stiffness, creep_time=law.creep_time,
        )  # fmt: skip
        material = replace(material, behaviour=behaviour)
    changes = {"platform": platform, "cables": cables, "cable": material}
    done = "Identified from free motion"
    return fitted_robot(robot, done, motion.status, motion.unknowns, **changes)


def _turns_figure(motion: SwingFit, stretches: Sequence[PredictedStretch], title: str) -> Figure:
    """Turns about the sensor's axes, measured and predicted, a column a stretch."""
    from cdpr_drake.analyses.frame.figures import line_style, new_figure
    from cdpr_drake.palette import nth_look

    count = len(stretches)
    figure, axes = new_figure(
        3, count, (max(9.0, 5.0 * count), 8.4),
        f"Free motion of {motion.task.robot.name} ({title})",
    )  # fmt: skip
    grid = np.array(axes, dtype=object).reshape(3, count)
    for column, stretch in zip(grid.T, stretches, strict=True):
        time, covered = stretch.stretch.time, stretch.stretch.covered
        for k, panel in enumerate(column):
            measured = np.where(covered, np.degrees(stretch.measured_turns[:, k]), np.nan)
            predicted = np.degrees(stretch.predicted_turns[:, k])
            panel.plot(time - time[0], measured, label="measured", **line_style(nth_look(0)))
            panel.plot(time - time[0], predicted, label="predicted", **line_style(nth_look(1)))
            if np.isfinite(stretch.lead):
                panel.axvline(stretch.lead, color="0.4", linestyle="--", linewidth=1.0)
        column[0].set(title=f"from {time[0]:.6g} s")
        column[2].set(xlabel="time [s]")
    for panel, axis in zip(grid[:, 0], "xyz", strict=True):
        panel.set(ylabel=f"turn about {axis} [deg]")
    _legend_below(figure, grid[0, 0])
    return figure


def _unexplained_figure(motion: SwingFit) -> Figure:
    """Forces that neither cables nor weight explain, a panel a stretch, and a remark's limit."""
    from cdpr_drake.analyses.frame.figures import few_ticks, line_style, new_figure
    from cdpr_drake.palette import BOUND, nth_look

    stretches = [
        (title, stretch.stretch.time, stretch.unexplained)
        for title, each in (("fitted", motion.fitted), ("held out", motion.held_out))
        for stretch in each if stretch.unexplained is not None
    ]  # fmt: skip
    platform = motion.model.platform(motion.values)
    weight = platform.mass * float(np.linalg.norm(platform.acceleration()))
    figure, axes = new_figure(
        1, len(stretches), (max(9.0, 4.0 * len(stretches)), 4.4),
        f"Free motion of {motion.task.robot.name}: what neither cables nor weight explain",
    )  # fmt: skip
    row = np.array(axes, dtype=object).reshape(len(stretches))
    for panel, (title, time, rest) in zip(row, stretches, strict=True):
        force, means = np.linalg.norm(rest.force, axis=1), rest.means(rest.force)
        panel.plot(rest.time, force, label="at an instant", **line_style(nth_look(0)))
        panel.plot(
            rest.time[: len(means)] + 0.5 * PULL, np.linalg.norm(means, axis=1),
            label=f"mean over {PULL:g} s", **line_style(nth_look(1)),
        )  # fmt: skip
        panel.axhline(
            PULLED * weight, label=f"{100.0 * PULLED:g} % of the weight",
            **line_style(BOUND) | {"linewidth": 1.0},
        )  # fmt: skip
        few_ticks(panel.xaxis, 5)
        panel.set(title=f"{title}, from {time[0]:.6g} s", xlabel="time [s]", ylim=0.0)
    row[0].set(ylabel="force [N]")
    _legend_below(figure, row[0])
    return figure


def _legend_below(figure: Figure, panel: Any) -> None:
    """Explains the curves of a panel below all panels."""
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=3)
