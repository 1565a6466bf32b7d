"""What an identification from free motion says: numbers for JSON, tables, figures, a robot file."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table

from cdpr_drake.analyses.calibration.free_motion import FollowedStretch, FreeMotion
from cdpr_drake.analyses.calibration.free_motion_balance import PULL, PULLED
from cdpr_drake.analyses.calibration.free_motion_model import CREEP, HYSTERESIS, STIFFENING
from cdpr_drake.analyses.calibration.log_fit import LogFit
from cdpr_drake.analyses.frame.figures import few_ticks, line_style, new_figure
from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.provenance import package_versions
from cdpr_drake.analyses.reporting.tables import new_table
from cdpr_drake.arrays import Array
from cdpr_drake.identification.result import MISFIT, MISFIT_FACTOR
from cdpr_drake.models.materials import BehaviourSettings, OwnMaterial
from cdpr_drake.models.robot_schema import HysteresisSettings, Robot
from cdpr_drake.palette import BOUND, nth_look

RESULTS = "identification.json"
"""File of a results folder: all numbers."""

LARGE = 0.3
"""Turns about an axis have a frequency of their own where they are as large beside the largest."""

FINENESS = 16
"""Of the grid of frequencies, beside that of the stretch's length."""


def dominant_frequency(time: Array, values: Array) -> float:
    """Where the spectrum of even samples is largest [Hz], by Hann's window and a parabola.

    Args:
        time: Shape (n,) [s].
        values: Shape (n,).
    """
    n, step = len(time), float(time[1] - time[0])
    window = np.hanning(n)
    middle = float(np.sum(window * values) / np.sum(window))
    size = FINENESS * n
    power = np.abs(np.fft.rfft((values - middle) * window, size))
    frequencies = np.fft.rfftfreq(size, step)
    inside = np.flatnonzero(frequencies >= 1.0 / (n * step))
    k = int(inside[np.argmax(power[inside])])
    if not 0 < k < len(power) - 1:
        return float(frequencies[k])
    a, b, c = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    shift = 0.5 * (a - c) / (a - 2.0 * b + c) if a - 2.0 * b + c != 0.0 else 0.0
    return float(frequencies[k] + shift * frequencies[1])


def axis_frequencies(one: FollowedStretch) -> list[dict[str, Any]]:
    """Dominant frequencies of turns about the sensor's axes, measured and predicted.

    About axes where turns are as large as `LARGE` of the largest; behind the lead, of a stretch
    that was predicted.
    """
    rows = one.after_lead()
    time, found = one.stretch.time[rows], []
    sizes = np.std(one.measured_turns[rows], axis=0)
    for k, axis in enumerate("xyz"):
        if sizes[k] < LARGE * np.max(sizes):
            continue
        measured = dominant_frequency(time, one.measured_turns[rows, k])
        predicted = dominant_frequency(time, one.predicted_turns[rows, k])
        found.append(
            {"axis": axis, "measured_hz": measured, "predicted_hz": predicted,
             "off": predicted / measured - 1.0}
        )  # fmt: skip
    return found


def _stretch_dict(one: FollowedStretch) -> dict[str, Any]:
    time = one.stretch.time
    return {
        "from_s": float(time[0]), "until_s": float(time[-1]),
        "state_from_first_s": finite(one.lead), "turn_rms_rad": one.turn_rms(),
        "position_rms_m": one.position_rms(), "tension_rms_n": one.tension_rms(),
        "frequencies": axis_frequencies(one),
        "unexplained": _unexplained_dict(one),
    }  # fmt: skip


def _unexplained_dict(one: FollowedStretch) -> dict[str, float] | None:
    """Largest means of what neither cables nor weight explain, and when."""
    rest = one.unexplained
    if rest is None:
        return None
    force, force_at = rest.largest(rest.force)
    moment, moment_at = rest.largest(rest.moment)
    return {
        "force_n": force, "force_at_s": force_at, "moment_nm": moment, "moment_at_s": moment_at,
        "mean_over_s": PULL,
    }  # fmt: skip


def free_motion_dict(found: FreeMotion) -> dict[str, Any]:
    """Everything for JSON."""
    recorded = found.fitted[0].stretch.recorded
    by = "measured" if recorded.positions is not None else "by measured turns and cable lengths"
    told: dict[str, Any] = finite(
        {
            "robot": found.task.robot.name,
            "log": str(found.log.path),
            "method": "free motion",
            "status": found.status,
            "parameters": [
                {"name": u.name, "unit": u.unit, "value": float(x), "std": float(s),
                 "before": u.before}
                for u, x, s in zip(found.unknowns, found.values, found.std, strict=True)
            ],
            "residuals_over_sigma": found.spread,
            "misfit_factor": MISFIT_FACTOR,
            "correlation_instants": found.correlation_time,
            "sigmas": {
                "turn_rad": found.task.sigmas.turn, "position_m": found.task.sigmas.position,
                "tension_n": found.task.sigmas.tension,
            },
            "priors": dict(found.task.priors),
            "positions": by,
            "fitted": [_stretch_dict(one) for one in found.fitted],
            "held_out": [_stretch_dict(one) for one in found.held_out],
            "modes_hz": found.modes[0].tolist(),
            "modes_before_hz": found.modes[1].tolist(),
            "remarks": list(found.remarks),
            "steps": found.steps,
            "wall_time_s": found.wall_time,
            "versions": package_versions(),
        }
    )  # fmt: skip
    return told


def _tables(found: FreeMotion) -> list[Table]:
    table = new_table(
        f"Free motion of {found.task.robot.name}: {found.status}, residuals {found.spread:.2f} "
        "sigma", ("fitted parameter",), ("before", "found", "std. error", "unit"),
    )  # fmt: skip
    for u, x, s in zip(found.unknowns, found.values, found.std, strict=True):
        table.add_row(u.name, f"{u.before:.5g}", f"{x:.5g}", f"{s:.2g}", u.unit)
    follow = new_table(
        "Predicted beside measured", ("stretch [s]",),
        ("turn rms [deg]", "position rms [mm]", "tension rms [N]", "unexplained [N]",
         "frequencies [Hz]"),
    )  # fmt: skip
    for words, ones in (("fitted", found.fitted), ("held out", found.held_out)):
        for one in ones:
            told = _stretch_dict(one)
            lead = "" if words == "fitted" else f", state from the first {one.lead:g} s"
            place, pull = told["position_rms_m"], told["tension_rms_n"]
            frequencies = ", ".join(
                f"{f['axis']} {f['measured_hz']:.3f}, predicted {f['predicted_hz']:.3f}"
                for f in told["frequencies"]
            )
            follow.add_row(
                f"{words} {told['from_s']:.6g}:{told['until_s']:.6g}{lead}",
                f"{np.degrees(told['turn_rms_rad']):.3g}",
                "" if place is None else f"{1e3 * place:.3g}",
                "" if pull is None else f"{pull:.3g}",
                "" if (rest := told["unexplained"]) is None else f"{rest['force_n']:.3g}",
                frequencies,
            )  # fmt: skip
    modes = new_table("Modes about rest [Hz]", ("robot",), tuple("123456"))
    for words, row in (("found", found.modes[0]), ("as believed before", found.modes[1])):
        modes.add_row(words, *(f"{f:.3f}" for f in row))
    tables = [table, follow, modes]
    if found.remarks:
        notes = new_table("To know", ("remark",), ())
        for words in found.remarks:
            notes.add_row(words)
        tables.append(notes)
    return tables


def _figure(found: FreeMotion, which: str) -> Figure:
    """Turns about the sensor's axes, measured and predicted, a column a stretch."""
    ones = found.held_out if which == "held_out" else found.fitted
    words = "held out: predicted behind the dashed line" if which == "held_out" else "fitted"
    figure, axes = new_figure(
        3, len(ones), (max(9.0, 5.0 * len(ones)), 8.4),
        f"Free motion of {found.task.robot.name} ({words})",
    )  # fmt: skip
    grid = np.array(axes, dtype=object).reshape(3, len(ones))
    for j, one in enumerate(ones):
        time = one.stretch.time - one.stretch.time[0]
        for k, axis in enumerate("xyz"):
            ax = grid[k, j]
            known = np.where(one.stretch.known > 0.0, np.degrees(one.measured_turns[:, k]), np.nan)
            ax.plot(time, known, label="measured", **line_style(nth_look(0)))
            ax.plot(
                time, np.degrees(one.predicted_turns[:, k]), label="predicted",
                **line_style(nth_look(1)),
            )  # fmt: skip
            if np.isfinite(one.lead):
                ax.axvline(one.lead, color="0.4", linestyle="--", linewidth=1.0)
            if j == 0:
                ax.set(ylabel=f"turn about {axis} [deg]")
        grid[0, j].set(title=f"from {one.stretch.time[0]:.6g} s")
        grid[2, j].set(xlabel="time [s]")
    _legend_below(figure, grid[0, 0])
    return figure


def _unexplained_figure(found: FreeMotion) -> Figure:
    """What neither cables nor weight explain, a panel a stretch, beside what is worth a word."""
    ones = [one for one in (*found.fitted, *found.held_out) if one.unexplained is not None]
    fitted = len([one for one in found.fitted if one.unexplained is not None])
    weight = found.model.by_name(found.values)["mass"] * float(
        np.linalg.norm(found.task.robot.gravity_vector())
    )
    figure, axes = new_figure(
        1, len(ones), (max(9.0, 4.0 * len(ones)), 4.4),
        f"Free motion of {found.task.robot.name}: what neither cables nor weight explain",
    )  # fmt: skip
    row = np.array(axes, dtype=object).reshape(len(ones))
    for j, one in enumerate(ones):
        rest = one.unexplained
        assert rest is not None
        force, means = np.linalg.norm(rest.force, axis=1), rest.means(rest.force)
        row[j].plot(rest.time, force, label="at an instant", **line_style(nth_look(0)))
        row[j].plot(
            rest.time[: len(means)] + 0.5 * PULL, np.linalg.norm(means, axis=1),
            label=f"mean over {PULL:g} s", **line_style(nth_look(1)),
        )  # fmt: skip
        row[j].axhline(
            PULLED * weight, label=f"{100.0 * PULLED:g} % of the weight",
            **line_style(BOUND) | {"linewidth": 1.0},
        )  # fmt: skip
        few_ticks(row[j].xaxis, 5)
        words = "fitted" if j < fitted else "held out"
        row[j].set(title=f"{words}, from {one.stretch.time[0]:.6g} s", xlabel="time [s]", ylim=0.0)
    row[0].set(ylabel="force [N]")
    _legend_below(figure, row[0])
    return figure


def _legend_below(figure: Figure, axes: Any) -> None:
    """Says below all panels what the curves of one are, where it hides none."""
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)


def freely_moved_robot(found: FreeMotion) -> Robot:
    """The robot with what was found."""
    robot, n = found.task.robot, found.model.by_name(found.values)
    unknown = {one.group for one in found.unknowns}
    platform = replace(
        robot.platform, mass=n["mass"],
        center_of_mass=np.array([n[f"center_of_mass.{a}"] for a in "xyz"]),
        inertia=np.array([n[f"inertia.{a}"] for a in ("xx", "yy", "zz", "xy", "xz", "yz")]),
    )  # fmt: skip
    if HYSTERESIS in unknown:
        rubbing = HysteresisSettings(
            tilt=n["hysteresis.tilt"], turn=n["hysteresis.turn"], slip=n["hysteresis.slip"]
        )
        rubs = rubbing.contacts().is_there()
        platform = replace(platform, hysteresis=rubbing if rubs else None)
    share = n["all.stiffness"] / float(np.mean(robot.cable_set().stiffness))
    cables = list(robot.cables)
    for k, (cable, material) in enumerate(zip(robot.cables, robot.materials(), strict=True)):
        own = cable.material or OwnMaterial()
        if "stiffness" in unknown:
            own = replace(own, youngs_modulus=material.youngs_modulus * share)
        if "damping" in unknown:
            own = replace(own, retardation_time=n["all.retardation_time"])
        cables[k] = replace(cable, material=own)
    material = robot.cable
    if unknown & {STIFFENING, CREEP}:
        does = found.model.behaviour(found.values)
        settings = replace(
            material.behaviour or BehaviourSettings(), stiffening=does.stiffening,
            creep_stiffness=does.creep_stiffness, creep_time=does.creep_time,
        )  # fmt: skip
        material = replace(material, behaviour=settings)
    words = f"Identified from free motion: {found.status}, {len(found.unknowns)} parameters."
    return replace(
        robot, platform=platform, cables=cables, cable=material,
        assumptions=f"{robot.assumptions} {words}".strip(),
    )  # fmt: skip


def free_motion_fit(found: FreeMotion) -> LogFit:
    """What is told of an identification from free motion."""
    drawings: dict[str, partial[Figure]] = {"fitted": partial(_figure, found, "fitted")}
    if found.held_out:
        drawings = {"held_out": partial(_figure, found, "held_out"), **drawings}
    if any(one.unexplained is not None for one in (*found.fitted, *found.held_out)):
        drawings["unexplained"] = partial(_unexplained_figure, found)
    return LogFit(
        freely_moved_robot(found), RESULTS, free_motion_dict(found), _tables(found), drawings,
        found.status != MISFIT,
    )  # fmt: skip
