"""Study: the servoing thesis' control stability workspaces, and every recipe for their tables.

The recipe in use is judged by samples, as the thesis does, by search and by proof, on the printed
rows of tables A.8 to A.18. As the thesis does not say how it drew its errors, every other recipe
is tried on all rows, by samples; printed rows are held against what any target leaves, and A.11
against other anchor points of the cables. Only full grids are judged: on coarse ones shares differ
by more than what is compared. `Form.recipe` asks for one recipe alone.

Source: servoing thesis 3.3.3 to 3.3.5 and A.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from functools import cache, partial
from itertools import combinations, product
from typing import Any

import numpy as np

from cdpr_drake.analyses.studies.control_stability_figures import (
    FIGURES,
    MET,
    RULES,
    TABLES_OF_ROWS,
    by_distance,
    distance,
    printed_rows,
    reasons,
)
from cdpr_drake.analyses.studies.recipe_variants import (
    CHOICES,
    EXCHANGED_CABLES,
    FITTED_TABLES,
    FULLY_CONSTRAINED,
    IN_USE,
    OTHER_ANCHORS,
    PRESENT,
    RECIPES,
    Recipe,
    arranged_anchors,
    exchanged_anchors,
)
from cdpr_drake.analyses.studies.stability_recipe import (
    RECIPE,
    SampledTask,
    VerdictsTask,
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
    single_bounds,
)
from cdpr_drake.analyses.studies.stability_tables import (
    BASELINE_VALUES,
    BY_NAME,
    TABLES,
    PublishedTable,
    covering_pairs,
    nested_pairs,
    steps_of,
)
from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.proofs.no_stable_target import stable_target_exists
from cdpr_drake.stability.perturbation_bounds import DIRECTIONS, PerturbationBounds
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from cdpr_drake.workspaces.volume import VolumeRule, cell_hull_share, workspace_volume

COVERAGE_SHARES = (0.25, 1.0)
"""Parts of the baseline bounds in rows of coverage, whose bound is called "share": certified poses
are counted there against searched ones."""

ROW_PIECES, COVERAGE_PIECES, QUICK_PIECES = 1, 600, 20
"""Pieces of a certificate at most, in printed rows and in rows of coverage, full and quick: to cut
the perturbations where the whole proves nothing would take hours in rows of large bounds."""

QUICK_TABLES, QUICK_RECIPE_TABLES = ("A.8", "A.10", "A.17"), ("A.11",)
"""Tables of the quick form, by verdicts and by recipes."""

POSES = 500
"""Poses that are judged at once: they share what is prepared."""

A11 = BY_NAME["A.11"]

CORNERS = {
    "as its exit point": (False, False), "other x": (True, False), "other y": (False, True),
    "opposite": (True, True),
}  # fmt: skip
"""Corner of the platform that a cable holds relative to that of its exit point: true with the other
sign along x, and along y."""

PAIRS = ((0, 0), *combinations(range(8), 2))
"""Cables in each other's place, by number from 0: none, then every exchange of two."""


def cases(form: Form) -> Iterator[Case]:
    """Printed rows by verdicts and by recipes, what any target leaves, other anchor points."""
    if form.recipe:
        yield from recipe_cases([RECIPES[form.recipe]], form)
        return
    yield from verdict_cases(form)
    yield from recipe_cases(RECIPES.values(), form)
    yield from limit_cases(form)
    yield from anchor_cases(form)


def verdict_cases(form: Form) -> Iterator[Case]:
    """The recipe in use by every verdict; in the quick form few rows, on coarse grids."""
    for table in _tables(form, QUICK_TABLES):
        case = recipe_case(table.robot, table.scheme)
        for bound, value, bounds in _verdict_rows(table, form.quick):
            pieces = ROW_PIECES
            if bound == "share":
                pieces = QUICK_PIECES if form.quick else COVERAGE_PIECES
            options = recipe_options(table.robot, pieces)
            task = VerdictsTask(case, bounds, table_grid(table.robot, form.quick), options)
            yield Case(
                keys=_keys("verdicts", table, bound, value, form),
                call=partial(verdict_row, task, table.full),
            )


def _verdict_rows(
    table: PublishedTable, quick: bool
) -> Iterator[tuple[str, float, PerturbationBounds]]:
    """Bound, value and bounds of rows of coverage and of printed ones."""
    first = next(iter(table.rows))
    baseline = recipe_bounds(table, first, BASELINE_VALUES[first])
    baseline = single_bounds(baseline.varied(exits="common", anchors="common"), "r_bp", 0.03)
    for share in COVERAGE_SHARES:
        yield "share", share, baseline.scaled(share)
    for bound, shares in table.rows.items():
        values = list(shares)
        for value in values[1:-1:2] if quick else values:
            yield bound, value, recipe_bounds(table, bound, value)


def recipe_cases(recipes: Iterable[Recipe], form: Form) -> Iterator[Case]:
    """Every printed row by some recipes, by samples."""
    for recipe, table in product(recipes, _tables(form, QUICK_RECIPE_TABLES)):
        case = recipe_case(table.robot, table.scheme, recipe)
        for bound, shares in table.rows.items():
            for value in shares:
                about = {
                    "recipe": recipe.name, "fitted": table.name in FITTED_TABLES,
                    "baseline": value == BASELINE_VALUES[bound],
                }  # fmt: skip
                yield Case(
                    keys=_keys("row", table, bound, value, form, **about),
                    call=_sampled(table, case, recipe_bounds(table, bound, value, recipe), form),
                )


def limit_cases(form: Form) -> Iterator[Case]:
    """What any target leaves of rows of exit and anchor points, the same for every scheme.

    Rows of the planar robot are none of them: what it sees of the object is wrong, too.
    """
    for table in _tables(form, QUICK_RECIPE_TABLES):
        if table.robot == "planar":
            continue
        others = OTHER_ANCHORS if table.robot == FULLY_CONSTRAINED else ()
        for bound in ("r_A", "r_B"):
            for value, name in product(table.rows[bound], (PRESENT.name, *others)):
                cables, bounds = _cables(table.robot, name), recipe_bounds(table, bound, value)
                grid = table_grid(table.robot, form.quick)
                yield Case(
                    keys=_keys("any target", table, bound, value, form, arrangement=name),
                    call=partial(limit_row, cables, bounds, grid),
                )


def anchor_cases(form: Form) -> Iterator[Case]:
    """A.11 with other anchor points: its baseline with every arrangement of them, and the rows of
    r_bp, which concern no single point, with every exchange of two cables.

    Cables from above hold the upper points or the lower ones, those from the floor the others, each
    at a corner that lies to that of its exit point as it does for all cables of the same height.
    """
    case = recipe_case(A11.robot, A11.scheme, PRESENT)
    bounds = recipe_bounds(A11, "r_bp", 0.03)
    for above, below, crossed in product(CORNERS, CORNERS, (False, True)):
        cables = arranged_anchors(case.cables, CORNERS[above], CORNERS[below], crossed)
        name = f"{'lower' if crossed else 'upper'}, {above}; {below}"
        yield Case(
            keys=_keys("arrangement", A11, "r_bp", 0.03, form, anchors=name),
            call=_sampled(A11, replace(case, cables=cables), bounds, form),
        )
    cables, case = case.cables, recipe_case(A11.robot, A11.scheme, EXCHANGED_CABLES)
    for pair, value in product(PAIRS, A11.rows["r_bp"]):
        other = replace(case, cables=exchanged_anchors(cables, *pair))
        bounds = recipe_bounds(A11, "r_bp", value, EXCHANGED_CABLES)
        yield Case(
            keys=_keys("exchange", A11, "r_bp", value, form, exchange=exchange_name(*pair)),
            call=_sampled(A11, other, bounds, form),
        )


def exchange_name(one: int, other: int) -> str:
    """Name of an exchange of cables, numbered from 0."""
    return "none" if one == other else f"A{one + 1} A{other + 1}"


def _tables(form: Form, quick: Iterable[str]) -> list[PublishedTable]:
    return [table for table in TABLES if not form.quick or table.name in quick]


def _keys(
    question: str, table: PublishedTable, bound: str, value: float, form: Form, **about: Any
) -> dict[str, Any]:
    """Keys of a row; what it answers comes first."""
    return {
        "question": question, **about, "table": table.name, "robot": table.robot,
        "scheme": table.scheme, "bound": bound, "value": value,
        "grid": "coarse" if form.quick else "full",
        "printed_percent": table.rows.get(bound, {}).get(value),
    }  # fmt: skip


def _sampled(
    table: PublishedTable, case: Any, bounds: PerturbationBounds, form: Form
) -> partial[dict[str, float]]:
    grid, options = table_grid(table.robot, form.quick), recipe_options(table.robot)
    return partial(sampled_row, SampledTask(case, bounds, grid, options), table.full)


@cache
def table_grid(robot: str, quick: bool) -> WorkspaceGrid:
    """Grid of a robot's tables; reading its file for every row takes minutes."""
    return recipe_grid(robot, quick)


@cache
def _cables(robot: str, recipe: str) -> CableSet:
    return RECIPES[recipe].cables(robot)


def by_parts(
    task: Callable[[int, int], Mapping[str, np.ndarray]], grid: WorkspaceGrid
) -> dict[str, np.ndarray]:
    """What a task finds of all poses of a grid without turns, shape (nx, ny, nz) by name."""
    parts = [task(k, min(k + POSES, grid.size)) for k in range(0, grid.size, POSES)]
    return {
        name: np.concatenate([part[name] for part in parts]).reshape(grid.shape)[0]
        for name in parts[0]
    }


def verdict_row(task: VerdictsTask, full: float) -> dict[str, Any]:
    """What of a grid is stable.

    Args:
        task: What is asked of its poses.
        full: Printed volume of the whole workspace [m^3]; of a planar one its area [m^2].

    Returns:
        By verdict its share of the full workspace, cells with all corners stable, VERDICT_percent,
        and poses of the grid, VERDICT_poses; poses: of the grid; ordered: true if at every pose
        certified implies searched and searched implies sampled.
    """
    stable = by_parts(task, task.grid)
    sampled, searched, certified = stable.values()
    volumes = {
        verdict: workspace_volume(inside, task.grid.axes, VolumeRule.CORNERS).value
        for verdict, inside in stable.items()
    }
    return {
        **{f"{verdict}_percent": 100.0 * volume / full for verdict, volume in volumes.items()},
        **{f"{verdict}_poses": int(np.sum(inside)) for verdict, inside in stable.items()},
        "poses": task.grid.size,
        "ordered": bool(np.all(certified <= searched) and np.all(searched <= sampled)),
    }


def sampled_row(task: SampledTask, full: float) -> dict[str, float]:
    """Share of the full workspace by three rules of the volume, RULE_percent, and of the grid's box
    by cells with all corners stable, box_percent; arguments as of `verdict_row`."""
    inside = by_parts(task, task.grid)["stable"]
    corners, points = (
        workspace_volume(inside, task.grid.axes, rule)
        for rule in (VolumeRule.CORNERS, VolumeRule.POINTS)
    )
    return {
        "corners_percent": 100.0 * corners.value / full,
        "cell_hulls_percent": 100.0 * (_hull_share(inside) * corners.full) / full,
        "points_percent": 100.0 * points.value / full,
        "box_percent": 100.0 * corners.share,
    }


def limit_row(
    cables: CableSet, bounds: PerturbationBounds, grid: WorkspaceGrid
) -> dict[str, float]:
    """What any target, view and camera leaves of a grid's box at most: at_most_percent, by the rule
    of the volume that leaves the most."""

    def stable(start: int, stop: int) -> dict[str, np.ndarray]:
        return {"stable": stable_target_exists(cables, bounds, grid.pose_rows(start, stop))}

    inside = by_parts(stable, grid)["stable"]
    rules = (VolumeRule.CORNERS, VolumeRule.POINTS)
    shares = [workspace_volume(inside, grid.axes, rule).share for rule in rules]
    return {"at_most_percent": 100.0 * max(*shares, _hull_share(inside))}


def _hull_share(inside: np.ndarray) -> float:
    """Share of the box by hulls of cells, without axes of one point."""
    return float(cell_hull_share(inside.reshape([n for n in inside.shape if n > 1])))


def parameters(form: Form) -> Mapping[str, Any]:
    """What all rows have in common."""
    names = [form.recipe] if form.recipe else list(RECIPES)
    return {
        "recipe": RECIPE,
        "choices": list(CHOICES),
        "baseline": BASELINE_VALUES,
        "options": {
            table.name: asdict(recipe_options(table.robot)) for table in _tables(form, QUICK_TABLES)
        },
        "pieces_in_rows_with_published_values": ROW_PIECES,
        "pieces_in_rows_of_coverage": QUICK_PIECES if form.quick else COVERAGE_PIECES,
        "recipes": {name: asdict(RECIPES[name]) for name in names},
    }


def numbers(rows: Frame) -> dict[str, Any]:
    """How many printed rows are repeated, distances by recipe, rule and table [points], printed
    rows beside each other, and why tables are not met."""
    recipes = printed_rows(rows, "row").groupby("recipe", sort=False)
    found: dict[str, Any] = {
        "mean_absolute_difference_points": {
            name: {
                rule: {
                    table: distance(mine, rule) for table, mine in some.groupby("table", sort=False)
                }
                for rule in RULES
            }
            for name, some in recipes
        },
        "nested_rows": [{**pair._asdict(), "contradictory": pair.more} for pair in nested_pairs()],
        "covering_rows": [{**pair._asdict(), "less": pair.less} for pair in covering_pairs()],
        "reasons": reasons(rows),
    }
    if (rows["question"] == "verdicts").any():
        counts = printed_rows(rows, "verdicts")["table"].value_counts(sort=False)
        found["printed_rows"] = {
            name: {"repeated": int(count), "of": BY_NAME[name].size}
            for name, count in counts.items()
        }
    return found


def best_recipe(rows: Frame) -> tuple[list[bool], str]:
    """Tables that are met by the recipe with the smallest distance over all rows."""
    groups = by_distance(rows)
    best = next(iter(groups))
    means = {
        name: {table: distance(some) for table, some in groups[name].groupby("table", sort=False)}
        for name in dict.fromkeys((PRESENT.name, IN_USE.name, best))
    }
    words = (
        f"{name} {distance(groups[name]):.1f} ({_listed(tables)})" for name, tables in means.items()
    )
    return [mean <= MET for mean in means[best].values()], f"{'; '.join(words)} points"


def explained(rows: Frame) -> tuple[list[bool], str]:
    """Tables that are not met, and whether the rows of bounds that are not ruled out are."""
    words = (
        f"{one['recipe']} {one['table']} {one['mean']:.1f}: {', '.join(one['rows']) or 'none'} "
        f"ruled out, other bounds {one['rest']:.1f}"
        for one in reasons(rows)
    )
    return [one["explained"] for one in reasons(rows)], "; ".join(words)


def shifts(rows: Frame) -> tuple[list[bool], str]:
    """Printed rows that leave more than a row whose errors they contain."""
    words = [
        f"{p.table} {p.first:.1f} % at r_A = {p.r_A:g} m, {p.second:.1f} at r_bp = {p.r_bp:g} m"
        for p in nested_pairs()
        if p.more
    ]
    held = [not pair.more for pair in nested_pairs()]
    return held, f"{held.count(False)} of {len(held)} leave more: {', '.join(words)}"


def common_exits(rows: Frame) -> tuple[list[bool], str]:
    """Printed rows that leave less than a row that contains a common shift of exit points."""
    pairs, words = covering_pairs(), []
    for name in dict.fromkeys(pair.table for pair in pairs if pair.less):
        less = [pair for pair in pairs if pair.less and pair.table == name]
        worst = max(less, key=lambda pair: pair.second - pair.first)
        words.append(
            f"{name} {len(less)}, most at r_A = {worst.r_A:g} m {worst.first:.1f} %, r_bp = "
            f"{worst.r_bp:g} m {worst.second:.1f}"
        )
    held = [not pair.less for pair in pairs]
    return held, f"{held.count(False)} of {len(held)} leave less: {'; '.join(words)}"


def never_rising(rows: Frame) -> tuple[list[bool], str]:
    """Steps from a printed row to the next larger bound."""
    held = [not step.rises for step in steps_of()]
    return held, f"{held.count(False)} of {len(held)} steps to the next printed row leave more"


def points_together(rows: Frame) -> tuple[list[bool], str]:
    """Tables whose rows of exit points and of anchor points are met by one way to be wrong."""
    recipes, held, words = by_distance(rows), [], []
    for table in BY_NAME:
        means = {}
        for way in DIRECTIONS:
            some = recipes[f"points-{way}"]
            mine = some[some["table"] == table]
            means[way] = [distance(mine[mine["bound"] == bound]) for bound in ("r_A", "r_B")]
        best = min(means, key=lambda way: max(means[way]))
        held.append(max(means[best]) <= MET)
        words.append(f"{table} {best} {means[best][0]:.1f} and {means[best][1]:.1f}")
    return held, f"r_A and r_B by the best way: {', '.join(words)} points"


def _listed(means: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {mean:.1f}" for name, mean in means.items())


STUDY = Study(
    name="control-stability",
    title="The servoing thesis' control stability workspaces, and every recipe for them",
    source="servoing thesis 3.3, tables A.8 to A.18",
    cases=cases,
    parameters=parameters,
    numbers=numbers,
    coarse=True,
    recipes=tuple(RECIPES),
    finds={
        "best_recipe": best_recipe,
        "explained": explained,
        "shifts": shifts,
        "common_exits": common_exits,
        "rising": never_rising,
        "points_together": points_together,
    },
    tables=TABLES_OF_ROWS,
    figures=FIGURES,
)
