"""What the scan of the camera's targets says of the printed rows, and its figure.

Shares of TARGETS belong to a grid with every second column, on which cells are larger and shares
smaller by one or two points: they choose a target, and `MET` is wider than that. What is kept is
compared on the whole grid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.control_stability.camera_scan import (
    AGAINST,
    ARRANGEMENTS,
    CHOOSING_BOUND,
    CHOOSING_TABLES,
    ELEVENTH,
    ELEVENTH_ROWS,
    HALF,
    KEPT,
    PAIRED_ROWS,
    PAIRS,
    SEEN,
    TARGETS,
    WHOLE,
    rows_asked,
    scan_cases,
    scan_row,
    table_named,
)
from cdpr_drake.analyses.studies.control_stability.camera_targets import (
    CENTRE_TARGET,
    CHOSEN_TARGET,
    HALF_TURN,
    HEIGHT,
    IN_USE_TARGET,
    SAME_ERROR,
    SEEN_TARGET,
    CameraTarget,
)
from cdpr_drake.analyses.studies.control_stability.tables import MET, SAME_MEAN
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CHOICE,
    FITTED,
    OURS,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.framework.study import Study
from cdpr_drake.analyses.studies.published.recipe_variants import IN_USE
from cdpr_drake.analyses.studies.published.stability_tables import BASELINE_VALUES
from cdpr_drake.analyses.visualization.figure_style import few_ticks, line_style, new_figure
from cdpr_drake.palette import PUBLISHED, nth_look

COARSER = 2.0
"""What a grid with every second column takes off a share, 1.2 at most in the rows in use
[points]."""

LARGEST_RISE = 1.0
"""By how much a longer error may leave more before it counts as more: draws are random [points]."""

DRAWN = (20.0, 30.0, 40.0, 50.0)
"""Rows of d_theta_pc in the figure [deg]."""


def apart(run: Run, bounds: Sequence[str] | None = None, changed: bool = False) -> np.ndarray:
    """Absolute differences of a case of TARGETS or KEPT to the printed rows [points].

    Args:
        run: Its row.
        bounds: Rows of which bounds; None: all.
        changed: Whether to leave the rows at the baseline out.
    """
    table = table_named(run["of_table"])
    return np.array(
        [
            abs(share - table.rows[bound][value])
            for (bound, value), share in zip(
                rows_asked(run["scan"], table), run["share_percent"], strict=True
            )
            if (bounds is None or bound in bounds)
            and not (changed and value == BASELINE_VALUES[bound])
        ]
    )


def chosen_means(runs: Runs, scan: str = TARGETS) -> dict[str, float]:
    """Mean difference over the rows that choose, by the target, the smallest first [points].

    Args:
        runs: Of the study.
        scan: TARGETS or SEEN.

    Raises:
        MissingRuns: Rows of a table lack.
    """
    means: dict[str, list[np.ndarray]] = {}
    for name in CHOOSING_TABLES:
        for run in runs(scan=scan, grid=HALF, of_table=name):
            means.setdefault(target_of(run).name, []).append(apart(run))
    if any(len(some) < len(CHOOSING_TABLES) for some in means.values()) or not means:
        raise MissingRuns(scan)
    found = {name: float(np.mean(np.concatenate(some))) for name, some in means.items()}
    return dict(sorted(found.items(), key=lambda item: item[1]))


def target_of(run: Run) -> CameraTarget:
    """The target of a case of TARGETS or KEPT."""
    goal = run["goal"]
    share = tuple(float(one) for one in goal.split()) if goal else (0.0, 0.0, 0.0)
    return CameraTarget(
        run["target"], run["length_m"], run["polar_deg"], run["azimuth_deg"],
        (share[0], share[1], share[2]), run["camera_m"], run["turn"], run["seen_turned"],
    )  # fmt: skip


@statement(
    "One translation error e_t for all poses, or one goal, gives the rows of d_theta_pc of A.9 and "
    "A.10.",
    "14 shares",
    source="tables A.9, A.10",
    rule=f"mean absolute difference of at most {MET:g} points; the target was chosen by these rows",
    basis=FITTED,
    cause=SOURCE,
)
def camera_target_chosen(runs: Runs) -> Finding:
    """The target with the smallest mean."""
    means = chosen_means(runs)
    best = next(iter(means))
    first = "; ".join(f"{name}: {mean:.1f}" for name, mean in list(means.items())[:3])
    whole = {
        target.name: float(
            np.mean(np.concatenate([apart(_kept(runs, name, target), (CHOOSING_BOUND,))
                                    for name in CHOOSING_TABLES]))
        )
        for target in (IN_USE_TARGET, CHOSEN_TARGET)
    }  # fmt: skip
    return Finding(
        found=f"smallest means of {len(means)} targets on every second column, in points: {first}; "
        f"in use {means[IN_USE_TARGET.name]:.1f}. On the whole grid "
        + ", ".join(f"{name} {mean:.1f}" for name, mean in whole.items()),
        held=[whole[CHOSEN_TARGET.name] <= MET],
        why="" if best == CHOSEN_TARGET.name else f"the scan chooses {best}, which is another one",
    )


@statement(
    "The e_t that the rows of d_theta_pc choose does not make the rows of other bounds of A.9 and "
    "A.10 worse.",
    "shares that did not choose",
    source="tables A.9, A.10",
    rule=f"mean absolute difference not larger by more than {SAME_MEAN:g} points, each bound by "
    "itself; without the baseline",
    cause=SOURCE,
)
def camera_target_kept(runs: Runs) -> Finding:
    """Rows that did not choose, by bound."""
    words, held = [], []
    for name in CHOOSING_TABLES:
        for bound in table_named(name).rows:
            if bound == CHOOSING_BOUND:
                continue
            before, after = (
                float(np.mean(apart(_kept(runs, name, target), (bound,), changed=True)))
                for target in (IN_USE_TARGET, CHOSEN_TARGET)
            )
            held.append(after <= before + SAME_MEAN)
            words.append(f"{name} {bound} {before:.1f}, {after:.1f}")
    return Finding(
        found=f"mean difference in points by the target in use and by the chosen one: "
        f"{'; '.join(words)}",
        held=held,
        why="One e_t cannot give both kinds of rows: what empties the workspace at d_theta_pc = 50 "
        "deg leaves too little where platform and points are wrong. So the tables belong to more "
        "than one target, of which the thesis names none. The camera is the one in use, so A.16, "
        "whose criterion has no e_t, does not change.",
    )


def _kept(runs: Runs, name: str, target: CameraTarget) -> Run:
    return runs.one(scan=KEPT, grid=WHOLE, of_table=name, **target.keys())


@statement(
    "An error of the camera's mounting also turns what the camera sees: the rows of d_theta_pc of "
    "A.9 and A.10, 0 at 50 deg among them, with the goal in use.",
    "14 shares",
    source="tables A.9, A.10",
    rule=f"mean absolute difference of at most {MET:g} points, each table by itself; theta u was "
    "chosen by these rows",
    basis=FITTED,
    cause=CHOICE,
)
def seen_turned_chosen(runs: Runs) -> Finding:
    """The rotation error with the smallest mean."""
    means = chosen_means(runs, SEEN)
    best = next(iter(means))
    words, held = [], []
    for name in CHOOSING_TABLES:
        run, before = (_kept(runs, name, target) for target in (SEEN_TARGET, IN_USE_TARGET))
        one, other = (float(np.mean(apart(some, (CHOOSING_BOUND,)))) for some in (run, before))
        held.append(one <= MET)
        asked = zip(rows_asked(KEPT, table_named(name)), run["share_percent"], strict=True)
        shares = [f"{share:.1f}" for (bound, _), share in asked if bound == CHOOSING_BOUND]
        words.append(f"{name} {one:.1f} ({', '.join(shares)}), in use {other:.1f}")
    return Finding(
        found="every second column, means in points: "
        + "; ".join(f"{name} {mean:.1f}" for name, mean in means.items())
        + f". Whole grid: {'; '.join(words)}",
        held=held,
        why="" if best == SEEN_TARGET.name else f"the scan chooses {best}, which is another one",
    )


@statement(
    "What is seen turned, as the rows of d_theta_pc choose it, does not make the rows of other "
    "bounds of A.9 and A.10 worse.",
    "shares that did not choose",
    source="tables A.9, A.10",
    rule=f"mean absolute difference not larger by more than {SAME_MEAN:g} points, each table by "
    "itself; without the baseline",
    cause=CHOICE,
)
def seen_turned_kept(runs: Runs) -> Finding:
    """Rows that did not choose."""
    words, held = [], []
    for name in CHOOSING_TABLES:
        others = [bound for bound in table_named(name).rows if bound != CHOOSING_BOUND]
        before, after = (
            float(np.mean(apart(_kept(runs, name, target), others, changed=True)))
            for target in (IN_USE_TARGET, SEEN_TARGET)
        )
        held.append(after <= before + SAME_MEAN)
        words.append(f"{name} {before:.1f} before, {after:.1f} after")
    return Finding(found=f"mean difference in points: {', '.join(words)}", held=held)


@statement(
    "Each printed row of d_theta_pc of A.9 and A.10 is what some e_t or goal gives.",
    "14 shares",
    source="tables A.9, A.10",
    rule="printed between the smallest and the largest share of all targets, within "
    f"{MET:g} points",
    basis=FITTED,
    cause=SOURCE,
)
def camera_target_range(runs: Runs) -> Finding:
    """Ranges over single targets."""
    words, held = [], []
    for name in CHOOSING_TABLES:
        shares = np.array(runs(scan=TARGETS, grid=HALF, of_table=name).list("share_percent"))
        for (bound, value), column in zip(
            rows_asked(TARGETS, table_named(name)), shares.T, strict=True
        ):
            printed, low, high = table_named(name).rows[bound][value], min(column), max(column)
            held.append(bool(low - MET <= printed <= high + MET))
            words.append(f"{name} {value:g} deg {printed:.1f} ({low:.1f} to {high:.1f})")
    return Finding(found=f"printed (smallest to largest): {'; '.join(words)}", held=held)


@statement(
    f"The rows of other bounds of A.9 and A.10 belong to targets at which nothing is left at "
    f"d_theta_pc = {AGAINST[1]:g} deg, as these tables print.",
    f"{2 * len(PAIRED_ROWS)} shares",
    source="tables A.9, A.10",
    rule="not more is printed than the share of the poses at which some target of the scan, which "
    f"may be another one at every pose, is stable in the row and unstable at {AGAINST[1]:g} deg, "
    f"within {COARSER:g} points, for the coarser grid",
    basis=FITTED,
    cause=SOURCE,
)
def rows_of_one_target(runs: Runs) -> Finding:
    """What is left at most of a row if its target leaves nothing in another one."""
    words, held = [], []
    for name in CHOOSING_TABLES:
        run = runs.one(scan=PAIRS, grid=HALF, of_table=name)
        for (bound, value), share in zip(PAIRED_ROWS, run["share_percent"], strict=True):
            printed = table_named(name).rows[bound][value]
            held.append(printed <= share + COARSER)
            words.append(f"{name} {bound} {value:g} {printed:.1f}, at most {share:.1f}")
    return Finding(
        found="; ".join(words),
        held=held,
        why="As long as the object is seen without error: what empties the workspace is then a "
        "long e_t, which leaves less in the other rows.",
    )


@statement(
    "Some e_t or goal and some arrangement of the points gives the baseline of A.11 and its row "
    "d_theta_bp = 20 deg, and keeps the other rows that are missed.",
    "97.0 and 45.4 %",
    source="table A.11",
    rule=f"both within {MET:g} points and the mean absolute difference over "
    f"{len(ELEVENTH_ROWS)} rows at most that, by one target and arrangement",
    basis=FITTED,
    cause=SOURCE,
)
def eleventh_rows(runs: Runs) -> Finding:
    """The target of each arrangement that comes closest, and what the row of 20 deg keeps."""
    table = table_named(ELEVENTH)
    printed = np.array([table.rows[bound][value] for bound, value in ELEVENTH_ROWS])
    words, worst = [], []
    for arrangement in ARRANGEMENTS:
        some = runs(scan=TARGETS, grid=HALF, of_table=ELEVENTH, points=arrangement)
        shares = np.array(some.list("share_percent"))
        apart_by = np.abs(shares - printed)
        off = np.maximum(np.max(apart_by[:, :2], axis=1), np.mean(apart_by, axis=1))
        best = int(np.argmin(off))
        worst.append(float(off[best]))
        kept = shares[:, 0] >= printed[0] - MET
        least = f"{np.min(shares[kept, 1]):.1f} at least" if np.any(kept) else "no target"
        words.append(
            f"{arrangement} {shares[best, 0]:.1f} and {shares[best, 1]:.1f} by "
            f"{target_of(some.rows[best]).name}, mean {np.mean(apart_by[best]):.1f}; with the "
            f"baseline met {least}"
        )
    return Finding(found=". ".join(words), held=[min(worst) <= MET])


@statement(
    "The rows of A.11 that the recipe in use misses come closer by one e_t for all poses than by "
    "the centre of the box as goal.",
    ", ".join(f"{table_named(ELEVENTH).rows[bound][value]:.1f}" for bound, value in ELEVENTH_ROWS),
    source="table A.11",
    rule=f"the smallest mean absolute difference over these rows is at most {MET:g} points",
    basis=FITTED,
    cause=CHOICE,
)
def eleventh_target(runs: Runs) -> Finding:
    """Means over the rows of A.11 that are scanned, with the points in use."""
    some = runs(scan=TARGETS, grid=HALF, of_table=ELEVENTH, points=IN_USE.name)
    means = {target_of(run).name: float(np.mean(apart(run))) for run in some}
    best = sorted(means, key=lambda name: means[name])[:3]
    shares = {target_of(run).name: run["share_percent"] for run in some}
    return Finding(
        found=f"mean difference in points: {CENTRE_TARGET.name} {means[CENTRE_TARGET.name]:.1f}; "
        + "; ".join(
            f"{name} {means[name]:.1f} ({', '.join(f'{one:.1f}' for one in shares[name])})"
            for name in best
        ),
        held=[means[best[0]] <= MET],
    )


@statement(
    "The longer e_t is, the smaller an error of the camera's mounting is tolerated.",
    "offset |exp(d) e_t - e_t| in (3.20)",
    rule=f"the mean over all directions does not rise by more than {LARGEST_RISE:g} point from one "
    "length to the next, in any row of d_theta_pc of A.9 and A.10",
    basis=OURS,
)
def length_decides(runs: Runs) -> Finding:
    """Shares over the length."""
    words, held = [], []
    for name in CHOOSING_TABLES:
        lengths, _, means, _ = shares_over_length(runs(scan=TARGETS, grid=HALF), name)
        rises = np.max(np.diff(means, axis=0), axis=0)
        held += (rises <= LARGEST_RISE).tolist()
        words.append(
            f"{name} from {lengths[0]:g} to {lengths[-1]:g} m "
            + ", ".join(
                f"{value:g} deg {first:.1f} to {last:.1f}"
                for value, first, last in zip(
                    table_named(name).rows[CHOOSING_BOUND], means[0], means[-1], strict=True
                )
            )
        )
    return Finding(found="; ".join(words), held=held)


def shares_over_length(
    runs: Runs, name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Shares of a table's rows of d_theta_pc over the length of e_t, same at every pose.

    Args:
        runs: Of the study.
        name: Of the table.

    Returns:
        Lengths, shape (n,) [m], and over all directions smallest, mean and largest shares, shape
        (n, rows) [%].
    """
    some = runs(scan=TARGETS, of_table=name, target=SAME_ERROR, camera_m=HEIGHT, turn=HALF_TURN)
    found: dict[float, np.ndarray] = {
        length: np.array(group.list("share_percent"), float)
        for length, group in some.by("length_m")
    }
    lengths = sorted(found)
    parts = [found[length] for length in lengths]
    return (
        np.array(lengths),
        np.array([np.min(part, axis=0) for part in parts]),
        np.array([np.mean(part, axis=0) for part in parts]),
        np.array([np.max(part, axis=0) for part in parts]),
    )


def camera_targets_figure(runs: Runs) -> Figure:
    """Shares over the length of e_t with their spread over its direction, and the printed ones."""
    figure, panels = new_figure(
        1, len(CHOOSING_TABLES), (10.5, 5.0),
        "Rows of d_theta_pc over the length of e_t; bands: all directions",
    )  # fmt: skip
    for axes, name in zip(np.ravel(np.array(panels, object)), CHOOSING_TABLES, strict=True):
        lengths, low, mean, high = shares_over_length(runs, name)
        printed = table_named(name).rows[CHOOSING_BOUND]
        for number, value in enumerate(DRAWN):
            column = list(printed).index(value)
            look = nth_look(number)
            axes.fill_between(lengths, low[:, column], high[:, column], color=look.color, alpha=0.2)
            axes.plot(
                lengths, mean[:, column], **line_style(look), marker=look.marker, markersize=5,
                label=f"{value:g} deg",
            )  # fmt: skip
            axes.axhline(printed[value], color=look.color, linewidth=0.8, linestyle=look.dash)
            axes.plot(
                lengths[-1] * 1.03, printed[value], PUBLISHED.marker, color=PUBLISHED.color,
                markersize=10, clip_on=False, label="printed" if value == DRAWN[-1] else None,
            )  # fmt: skip
            axes.annotate(
                f"{value:g} deg",
                (lengths[-1] * 1.06, printed[value]),
                va="center",
                fontsize=8,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
            )
        axes.set_title(f"Table {table_named(name).title}", fontsize=10)
        axes.set_xlabel("length of e_t [m]")
        axes.set_xlim(0.0, lengths[-1] * 1.18)
        axes.set_ylim(-3.0, 103.0)
        few_ticks(axes.xaxis)
    np.ravel(np.array(panels, object))[0].set_ylabel("workspace [%]")
    handles, labels = np.ravel(np.array(panels, object))[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


SCAN_CHECKS: tuple[Check, ...] = (
    camera_target_chosen, camera_target_range, camera_target_kept, rows_of_one_target,
    seen_turned_chosen, seen_turned_kept, length_decides, eleventh_rows, eleventh_target,
)  # fmt: skip
"""Statements that the scan judges."""

CHUNK = 500
"""Poses per chunk."""

STUDY = Study(
    name="stability-targets",
    title="Tables A.9 to A.11 by the camera's target: what one can give, and what none can",
    source="servoing thesis 3.3, tables A.9 to A.11",
    cases=scan_cases,
    reduce=scan_row,
    chunk=CHUNK,
    unit="poses",
    before="listing targets",
    stated="What follows for the printed tables",
    checks=SCAN_CHECKS,
    figures={"camera_targets": camera_targets_figure},
)
