"""Study: tension methods in the loop, by coverage and by speed, beside the Gazebo thesis."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import (
    bar_style,
    draw_curve,
    line_style,
    new_figure,
    phase_of,
)
from cdpr_drake.analyses.studies import tension_trials as tt
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study, select
from cdpr_drake.analyses.tensions import applicable_methods
from cdpr_drake.control.force_balance import FORCE, WRENCH
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.palette import BOUND, DASHED, DOTTED, SOLID, Look, look_of, nth_look

COVERAGE = "grid"
"""What stands for the experiment of methods on grids of poses."""

NUMBERS = {
    "linear_program": (8, 9, 10), "quadratic_program": (11, 12, 13, 14),
    "pseudo_inverse": (15, 16, 17), "closed_form": (18, 19, 20),
}  # fmt: skip
"""Numbers in chapter 6 of the figures, gain by gain."""

DRAWN = 2e4
"""Larger tensions, of platforms that are lost, are drawn as this [N]."""

DASHES = {tt.Applied.HELD: SOLID, tt.Applied.CUT: DOTTED, tt.Applied.PUSHED: DASHED}
GAINS = tt.THESIS_GAINS["quadratic_program"]
"""All gains Kp of the study, each with its colour and marker in all figures [1/s^2]."""


def cases(form: Form) -> Iterator[Case]:
    """The runs; then each method on the grid of each robot, where it is timed."""
    for spec in tt.trials(form.quick):
        yield Case(keys=spec.keys(), call=partial(tt.run_trial, spec))
    for start in tt.start_trials(form.quick):
        yield Case(keys=start.keys(), call=partial(tt.run_start_trial, start))
    grid = tt.QUICK_GRID if form.quick else tt.GRID
    for name in (tt.THESIS_ROBOT, tt.OTHER_ROBOT):
        robot = load_robot(name)
        for method in applicable_methods(tension_problem(robot, robot.home.transform())):
            keys = {"experiment": COVERAGE, "robot": name, "method": method}
            yield Case(keys=keys, call=partial(tt.cover, name, grid, method), alone=True)


def parameters(form: Form) -> Mapping[str, Any]:
    """What all runs have in common; nothing is random."""
    robot, path = load_robot(tt.THESIS_ROBOT), tt.thesis_path()
    return {
        "experiments": tt.EXPERIMENTS | tt.START_EXPERIMENTS, "integrator": "runge_kutta3",
        "integration_step_s": tt.STEP, "mass_kg": robot.platform.mass,
        "tension_bounds_n": robot.tension_limits(), "printed_start_m": tt.THESIS_START,
        "printed_end_m": tt.THESIS_END, "printed_places_are": "of the middle of the platform",
        "start_m": path.ends[0], "end_m": path.ends[1],
        "start_and_end_are": "of P, the middle of the bottom face",
        "start_least_shift_m": path.limits[0], "end_least_shift_m": path.limits[1],
        "start_shift_m": path.shifts[0], "end_shift_m": path.shifts[1],
        "grid": tt.QUICK_GRID if form.quick else tt.GRID, "grid_angles_deg": tt.TURNS_DEG,
    }  # fmt: skip


def near_instability(rows: Frame) -> tuple[list[bool], str]:
    """Whether gain 1200 of the linear and 1500 of the quadratic program fall, fail or err more.

    Compared with gain 100; beside it what starts 50 mm off, and what is controlled at 100 Hz.
    """

    def row(experiment: str, method: str, gain: float) -> Any:
        found = select(rows, experiment=experiment, method=method, kp_per_s2=gain, applied="held")
        return found.iloc[0]

    def fails(one: Any) -> bool:
        return bool(one["lost"] or one["failures"] > 0)

    calm = row("thesis", "quadratic_program", 100.0)["position_error_max_m"]
    named = [row("thesis", "linear_program", 1200.0), row("thesis", "quadratic_program", 1500.0)]
    far = row("far_step", "quadratic_program", 1200.0)
    bad = [f"{gain:g}" for gain in GAINS if fails(row("slow", "quadratic_program", gain))]
    held = [fails(one) or bool(one["position_error_max_m"] > calm) for one in named]
    errors = ", ".join(f"{1e6 * one['position_error_max_m']:.3g}" for one in named)
    return held if all(held) else [*held, bool(far["lost"] or bad)], (
        f"at 1 kHz largest errors {errors} um, at gain 100 {1e6 * calm:.3g} um; from 50 mm beside "
        "it "
        + (f"falls after {far['end_time_s']:.1f} s" if far["lost"] else "does not fall")
        + f"; at 100 Hz unstable at gains {', '.join(bad) or 'none'}"
    )


def settings_tried(rows: Frame) -> Frame:
    """What could make tensions as large as the printed ones: the largest by setting and method, and
    how many of the twelve printed ones they meet."""
    settings: list[dict[str, Any]] = [
        {"experiment": tt.START_ERROR, "start": start, "balance": balance, "control_rate_hz": rate}
        for start, rate, balance in product(tt.STARTS, tt.RATES, (WRENCH, FORCE))
    ] + [
        {"experiment": tt.ONE_STEP, "start": start, "between": between}
        for start, between in product((tt.LAUNCH, tt.ON_PATH), (tt.STATIC, tt.NOTHING))
    ]
    printed, found = np.array([*tt.PRINTED.values()]), []
    for where in settings:
        mine = select(rows, **where)
        wide = mine.pivot(index="method", columns="kp_per_s2", values="tension_max_n")
        sizes = wide.loc[[*tt.PRINTED], [*tt.GAINS]].to_numpy(float)
        met = (printed / 2.0 <= sizes) & (sizes <= 2.0 * printed)
        words = [", ".join(f"{size:.3g}" for size in some) for some in sizes]
        methods = dict(zip(map(words_of, tt.PRINTED), words, strict=True))
        found.append({**where, "met of 12": met.sum(), **methods})
    return Frame(found)


def run_table(name: str, rows: Frame) -> Frame:
    """Numbers of an experiment's runs."""
    columns = {
        "method": "method", "applied": "out of bounds", "kp_per_s2": "Kp",
        "position_error_max_m": "error max [m]", "position_error_mean_m": "mean [m]",
        "tension_max_n": "tension max [N]", "tension_min_n": "min [N]",
        "tension_jump_max_n": "jump [N]", "negative_tensions": "negative", "failures": "failures",
        "control_steps": "of steps", "lost": "fell", "end_time_s": "ends [s]",
    }  # fmt: skip
    return select(rows, experiment=name)[[*columns]].rename(columns=columns)


def coverage_table(rows: Frame) -> Frame:
    """How much of each robot's grid each method solves, and its times."""
    columns = ["robot", "method", "poses", "feasible", "share", "wrong", "mean_largest_tension_n",
               "call_us", "kernel_us"]  # fmt: skip
    return select(rows, experiment=COVERAGE)[columns]


def start_table(name: str, rows: Frame) -> Frame:
    """Largest tensions of a start experiment, a column for each gain."""
    mine = select(rows, experiment=name)
    keys = ["start", "balance", "between", "method", "control_rate_hz"]
    wide = mine.pivot(index=keys, columns="kp_per_s2", values="tension_max_n")
    lost = mine.groupby(keys)["lost"].sum().rename("lost")
    turn = np.degrees(mine.groupby(keys)["turn_max_rad"].max().astype(float)).rename("turn [deg]")
    return wide.join([lost, turn]).reset_index()


def words_of(name: str) -> str:
    """A name without underscores."""
    return name.replace("_", " ")


def error_figure(experiment: str, rows: Frame) -> Figure:
    """Position errors over time of the runs of one experiment, a panel for each method."""
    mine = select(rows, experiment=experiment)
    methods = dict([*mine.groupby("method", sort=False)])
    drawn, panels = _panels(len(methods), "Position error", experiment, "error [mm]")
    for axes, (method, runs) in zip(panels, methods.items(), strict=True):
        fell = []
        for _, run in runs.iterrows():
            name = f"Kp {run['kp_per_s2']:g}, {run['applied']}"
            if run["lost"]:
                fell.append(f"{name} fell at {run['end_time_s']:.2f} s")
            if run["lost"] and run["end_time_s"] < 0.05 * run["wanted_duration_s"]:
                continue  # would not be seen
            number, arrays = GAINS.index(run["kp_per_s2"]), run["arrays"]
            look = Look(nth_look(number).color, DASHES[run["applied"]], nth_look(number).marker)
            errors = np.maximum(1e3 * arrays["errors_m"], 1e-9)
            draw_curve(axes, arrays["times_s"], errors, look, name,
                       phase=phase_of(number, len(GAINS)), markersize=4.0)  # fmt: skip
        axes.set(yscale="log", xlim=(0.0, mine["wanted_duration_s"].max()))
        axes.set_title(words_of(method), fontsize=11)
        lines = ["; ".join(fell[k : k + 2]) for k in range(0, len(fell), 2)]
        axes.legend(
            handles=list(axes.lines), title="\n".join(lines), title_fontsize=7, fontsize=7,
            ncols=2, loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=5.0,
        )  # fmt: skip
    _same_heights(panels)
    return drawn


def tension_figure(experiment: str, rows: Frame) -> Figure:
    """Tensions over time, of each method the lowest and the highest gain that stay up."""
    mine = select(rows, experiment=experiment)
    up = mine[~mine["lost"].astype(bool)]
    chosen: list[Any] = []
    for _, group in (up if len(up) else mine).groupby(["method", "applied"], sort=False):
        ordered = [run for _, run in group.sort_values("kp_per_s2").iterrows()]
        chosen += ordered[:1] + ordered[1:][-1:]
    drawn, panels = _panels(len(chosen), "Tensions", experiment, "tension [N]")
    for axes, run in zip(panels, chosen, strict=True):
        high = _draw_tensions(axes, run)
        applied = "" if run["applied"] == "held" else f", {run['applied']}"
        axes.set_title(f"{words_of(run['method'])}, Kp {run['kp_per_s2']:g}{applied}", fontsize=10)
        if high <= 1.5 * float(np.max(run["arrays"]["tensions_n"], initial=0.0)):
            style = line_style(BOUND) | {"linewidth": 1.0, "zorder": 1}
            axes.axhline(high, label=f"upper bound {high:g} N", **style)
    found = [axes.get_legend_handles_labels() for axes in panels]
    handles = {k: v for some, names in found for k, v in zip(names, some, strict=True)}
    drawn.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5)
    return drawn


def gains_figure(method: str, rows: Frame) -> Figure:
    """A method of the thesis, a row for each gain: figures 6.8 to 6.20.

    Methods that leave the bounds are shown on the printed path with cables that push, which is the
    only way in which they can be followed along it; the others on the path moved inside.
    """
    wanted = "printed" if method in tt.UNCHECKED else "thesis"
    mine = select(rows, experiment=wanted, method=method).sort_values("kp_per_s2")
    words = f"Gazebo thesis, figures 6.{NUMBERS[method][0]} to 6.{NUMBERS[method][-1]}: "
    words += f"{words_of(method)}, position error and cable tensions by gain"
    drawn, grid = new_figure(len(mine), 2, (13.0, 1.6 + 3.4 * len(mine)), words)
    panels = np.reshape(np.array(grid, object), (len(mine), 2))
    for (left, right), (_, run) in zip(panels, mine.iterrows(), strict=True):
        place = tt.THESIS_GAINS[method].index(run["kp_per_s2"])
        title = f"6.{NUMBERS[method][place]}: Kp = Kd = {run['kp_per_s2']:g}"
        draw_curve(left, run["arrays"]["times_s"], 1e6 * run["arrays"]["errors_m"], nth_look(0))
        left.set(ylabel="position error [\u00b5m]", ylim=(0.0, None), title=title)
        _draw_tensions(right, run)
        printed = tt.PRINTED[method][place : place + 1]
        said = f", printed {printed[0]:g} N" if printed else ""
        right.set(ylabel="tension [N]", title=f"largest {run['tension_max_n']:.1f} N{said}")
        for axes in (left, right):
            axes.set_xlim(0.0, run["wanted_duration_s"])
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    drawn.legend(*panels[0, 1].get_legend_handles_labels(), loc="outside lower center", ncols=9)
    return drawn


def start_figure(rows: Frame) -> Figure:
    """Largest tension over the start error; a row for rows and rate, a column for a method."""
    mine = select(rows, experiment=tt.START_ERROR)
    settings = mine[["balance", "control_rate_hz"]].drop_duplicates()
    title = (
        "Largest tension over the start error, by method and gain\n"
        "lines with symbols: found; thin: Gazebo thesis; crossed: lost"
    )
    size = (14.0, 1.8 + 2.9 * len(settings))
    drawn, grid = new_figure(len(settings), len(tt.PRINTED), size, title)
    panels: list[Axes] = list(np.ravel(grid))
    bound = load_robot(tt.THESIS_ROBOT).tension_limits()[1]
    pairs = product(settings.itertuples(index=False), tt.PRINTED.items())
    for axes, ((balance, rate), (method, printed)) in zip(panels, pairs, strict=True):
        for number, (gain, value) in enumerate(zip(tt.GAINS, printed, strict=True)):
            one = [balance, rate, method, gain]
            keys = ["balance", "control_rate_hz", "method", "kp_per_s2"]
            runs = mine[(mine[keys] == one).all(axis=1)].sort_values("start_error_m")
            if not len(runs):
                continue
            look = nth_look(number)
            _draw_largest(axes, runs, "start_error_m", look, f"Kp = Kd = {gain:g}")
            lost = runs[runs["lost"].astype(bool)]
            sizes = lost["tension_max_n"].clip(upper=DRAWN)
            axes.plot(lost["start_error_m"], sizes, "x", color="black", markersize=10.0)
            axes.axhline(value, color=look.color, linestyle=DASHED, linewidth=1.0)
        axes.axhline(bound, label=f"upper bound {bound:g} N", **line_style(BOUND))
        kind = "six rows" if balance == "wrench" else "three rows"
        axes.set_title(f"{words_of(method)}, {kind}, {rate:g} Hz", fontsize=10)
        axes.set(yscale="log", xlabel="start error [m]", ylabel="largest tension [N]")
        axes.label_outer()
    _same_heights(panels)
    drawn.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawn


def one_step_figure(rows: Frame) -> Figure:
    """Largest tensions where forces act for a tenth of the time, a panel for each method."""
    mine = select(rows, experiment=tt.ONE_STEP).sort_values("kp_per_s2", kind="stable")
    title = "Largest tension where forces act for 1 ms of 10 ms"
    drawn, panels = new_figure(1, len(tt.PRINTED), (14.0, 4.8), title)
    for axes, (method, printed) in zip(panels, tt.PRINTED.items(), strict=True):
        groups = mine[mine["method"] == method].groupby(["start", "between"], sort=False)
        for number, ((start, between), runs) in enumerate(groups):
            label = f"start: {start}; between: {between}"
            _draw_largest(axes, runs, "kp_per_s2", nth_look(number), label)
        axes.plot(tt.GAINS, printed, "k*", markersize=12.0, label="Gazebo thesis")
        axes.set(yscale="log", xlabel="Kp = Kd", ylabel="largest tension [N]")
        axes.set_title(words_of(method), fontsize=10)
        axes.label_outer()
    drawn.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return drawn


def _draw_largest(axes: Axes, runs: Frame, over: str, look: Look, label: str) -> None:
    """Largest tensions of runs over one of their columns."""
    sizes = runs["tension_max_n"].clip(upper=DRAWN)
    style = line_style(look) | {"marker": look.marker, "markersize": 5.0}
    axes.plot(runs[over], sizes, label=label, **style)


def coverage_figure(rows: Frame) -> Figure:
    """Share of the feasible poses that each method solves, and its time for one."""
    mine = select(rows, experiment=COVERAGE)
    robots, methods = list(mine["robot"].unique()), list(mine["method"].unique())
    drawn, (left, right) = new_figure(1, 2, (12.0, 6.5), "Coverage and speed of tension methods")
    height = 0.8 / len(robots)
    for k, (robot, runs) in enumerate(mine.groupby("robot", sort=False)):
        places = runs["method"].map(methods.index) + (k + 0.5) * height - 0.4
        style = bar_style(look_of(robot, sorted({tt.THESIS_ROBOT, tt.OTHER_ROBOT})))
        first, shares = runs.iloc[0], 100.0 * runs["share"]
        label = f"{robot}, {first['feasible']:.0f} of {first['poses']:.0f} poses feasible"
        bars = left.barh(places, shares, height, label=label, **style)
        left.bar_label(bars, fmt="{:.0f}", padding=2, fontsize=8)
        right.barh(places, runs["kernel_us"].astype(float), height, label=robot, **style)
    left.set(xlabel="feasible poses solved [%]", xlim=(0.0, 112.0))
    right.set(xlabel="one pose in a batch, on one core [us]")
    left.set_yticks(range(len(methods)), [words_of(name) for name in methods])
    right.set_yticks(range(len(methods)), [])
    for axes in (left, right):
        axes.invert_yaxis()
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09))
    return drawn


def _draw_tensions(axes: Any, run: Mapping[str, Any]) -> float:
    """Tensions over time and the lower bound; gives the upper one."""
    robot, arrays = load_robot(run["robot"]), run["arrays"]
    for k, cable in enumerate(robot.cables):
        draw_curve(
            axes, arrays["times_s"], arrays["tensions_n"][:, k], nth_look(k), cable.name,
            phase=phase_of(k, len(robot.cables)), linewidth=1.0, markersize=4.0,
        )  # fmt: skip
    low, high = robot.tension_limits()
    style = line_style(BOUND) | {"linewidth": 1.0, "zorder": 1}
    axes.axhline(low, label=f"lower bound {low:g} N", **style)
    return float(high)


def _panels(count: int, what: str, experiment: str, ylabel: str) -> tuple[Figure, list[Axes]]:
    title = f"{what}, experiment '{experiment}'\n{tt.EXPERIMENTS[experiment].rstrip('.')}"
    columns = min(3, count)
    rows = -(-count // columns)
    drawn, grid = new_figure(rows, columns, (max(4.2 * columns, 9.0), 1.2 + 3.2 * rows), title)
    panels: list[Axes] = list(np.ravel(grid))
    for k, axes in enumerate(panels):
        axes.set_ylabel(ylabel if k % columns == 0 else "")
        axes.set_xlabel("time [s]" if k + columns >= count else "")
        if k >= count:
            axes.remove()
    return drawn, panels[:count]


def _same_heights(panels: Sequence[Axes]) -> None:
    limits = np.array([axes.get_ylim() for axes in panels])
    for axes in panels:
        axes.set_ylim(limits[:, 0].min(), limits[:, 1].max())


def _named(make: Any, names: Iterable[str], ending: str = "", before: str = "") -> dict[str, Any]:
    return {f"{before}{name}{ending}": partial(make, name) for name in names}


STUDY = Study(
    name="tension-methods",
    title="Tension methods in the loop, by coverage and by speed, beside the Gazebo thesis",
    source="Gazebo thesis, chapter 6",
    cases=cases,
    parameters=parameters,
    finds={"near_instability": near_instability},
    moments={
        "position_error_max_m": "largest",
        "position_error_mean_m": "mean",
        "position_error_last_tenth_m": "end",
    },
    assumptions=(
        "A verdict is about the words. In the experiments up to acrobot the exact model follows "
        "the trajectory from its start, with tensions near 10 N; start_error and one_step try what "
        "could make them as large as the printed ones.",
    ),
    tables={
        **_named(run_table, tt.EXPERIMENTS),
        "Methods on grids of poses": coverage_table,
        **_named(start_table, tt.START_EXPERIMENTS),
        "What could explain the printed tensions": settings_tried,
    },
    figures={
        **_named(error_figure, tt.EXPERIMENTS, "_errors"),
        **_named(tension_figure, tt.EXPERIMENTS, "_tensions"),
        **_named(gains_figure, tt.THESIS_GAINS, before="gains_"),
        "start_errors": start_figure,
        "one_step": one_step_figure,
        "coverage": coverage_figure,
    },
)
