"""What follows from all recipes on all rows: the best one, and why tables are not met.

Each reason is computed: rows that the thesis' own definition forbids, and rows that no way in which
points may be wrong meets together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, verdict
from cdpr_drake.analyses.studies.control_stability.exchanges import (
    CHOOSING_BOUND,
    PRINTED,
    ExchangeRow,
    exchange_means,
    exchange_name,
    other_rows,
)
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    covering_pairs,
    nested_pairs,
    rising_rows,
)
from cdpr_drake.analyses.studies.control_stability.recipes import RULES, RecipeStudy
from cdpr_drake.analyses.studies.control_stability.table_reasons import (
    MET,
    LimitRow,
    TableReason,
    table_reasons,
)
from cdpr_drake.analyses.studies.published.recipe_variants import (
    EXCHANGE,
    EXCHANGED_CABLES,
    IN_USE,
    PRESENT,
    RECIPES,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES
from cdpr_drake.stability.perturbation_bounds import DIRECTIONS

NEARLY_WHOLE = 90.0
"""An arrangement of anchor points that leaves more at the baseline may be that of A.11 [%]."""

SAME = 0.5
"""Means that differ by less are the same [points]."""


@dataclass(frozen=True, eq=False)
class FoundRecipes:
    """What the study found.

    Attributes:
        recipes: By name, with rows.
        limits: What any target leaves.
        arrangements: Share at the baseline of A.11 by arrangement of anchor points [%].
        exchanges: What single exchanges of two cables leave.
        quick: Whether on coarse grids.
    """

    recipes: Mapping[str, RecipeStudy]
    limits: Sequence[LimitRow]
    arrangements: Mapping[str, float]
    exchanges: tuple[ExchangeRow, ...]
    quick: bool

    def full(self) -> None:
        """Nothing, of a full study.

        Raises:
            KeyError: It was the quick form, or something is missing.
        """
        whole = {table.name: table.size for table in TABLES}
        for one in self.recipes.values():
            if self.quick or len(one.rows) < sum(whole.values()):
                raise KeyError(one.recipe.name)

    def means(self, name: str) -> dict[str, float]:
        """Mean absolute difference by table of a recipe [points]."""
        return {table.name: self.recipes[name].difference(RULES[0], table.name) for table in TABLES}

    def order(self) -> list[str]:
        """Names of recipes, the smallest mean over all rows first."""
        return sorted(self.recipes, key=lambda name: self.recipes[name].difference(RULES[0]))

    def reasons(self) -> list[TableReason]:
        """Of the tables that the recipe in use does not meet, and the best one."""
        names = dict.fromkeys((IN_USE.name, *self.order()[:1]))
        return [
            reason
            for name in names
            if name in self.recipes and self.recipes[name].rows
            for reason in table_reasons(self.recipes[name], self.recipes[name].asked, self.limits)
        ]


def best_recipe(found: FoundRecipes) -> Statement:
    """One recipe for all tables."""
    found.full()
    whole = {name: one.difference(RULES[0]) for name, one in found.recipes.items()}
    order = found.order()
    names = dict.fromkeys((PRESENT.name, IN_USE.name, order[0]))
    means = {name: found.means(name) for name in names}
    over = [table for table, mean in means[order[0]].items() if mean > MET]
    parts = [
        f"{name} {whole[name]:.1f} ("
        + ", ".join(f"{table} {mean:.1f}" for table, mean in means[name].items())
        + ")"
        for name in names
    ]
    return Statement(
        f"Tables A.8 to A.18 by one recipe, all {sum(t.size for t in TABLES)} rows.",
        "shares",
        f"mean absolute difference in points: {'; '.join(parts)}",
        verdict(not over, len(over) < len(TABLES)),
        f"Above {MET:g} points by the recipe with the smallest mean: {', '.join(over) or 'none'}. "
        "No row is left out.",
    )


def spheres(found: FoundRecipes) -> Statement:
    """Rows that print more than any target leaves."""
    found.full()
    rows = [row for row in found.limits if row.arrangement == "present"]
    bad = [row for row in rows if row.excluded]
    tables = dict.fromkeys(row.table for row in bad)
    words = []
    for name in tables:
        for bound in ("r_A", "r_B"):
            mine = [row for row in bad if (row.table, row.bound) == (name, bound)]
            if mine:
                pairs = ", ".join(f"{r.value:g} m {r.printed:.1f} > {r.at_most:.1f}" for r in mine)
                words.append(f"{name} {bound} {pairs}")
    return Statement(
        "A pose belongs to the workspace if Pi is positive definite for any error within the "
        "bounds, each exit and anchor point within its own sphere.",
        "(3.27), 3.3.1",
        f"{len(bad)} of {len(rows)} printed rows leave more than that with any target, view and "
        f"camera: {'; '.join(words)}",
        verdict(not bad, len(bad) < len(rows)),
        "At these rows a perturbation within the bounds gives Pi an eigenvalue with a real part "
        "that is not positive, whatever the camera sees. So what is printed was found with fewer "
        "errors than the text allows, which it does not name; no choice that the text leaves open "
        "gives these numbers.",
    )


def shifts(found: FoundRecipes) -> Statement:
    """Printed rows that contradict each other."""
    pairs = [pair for table in TABLES for pair in nested_pairs(table)]
    bad = [pair for pair in pairs if pair.contradictory]
    return Statement(
        "An error of the exit points of r contains a common shift, which is an error of the "
        "platform's place of r + 0.025 m at the baseline; so it cannot leave more.",
        "(3.27)",
        f"{len(bad)} of {len(pairs)} printed rows leave more: "
        + ", ".join(
            f"{p.table} {p.first:.1f} % at r_A = {p.r_A:g} m, {p.second:.1f} at r_bp = {p.r_bp:g} m"
            for p in bad
        ),
        verdict(not bad, len(bad) < len(pairs)),
        "From the printed numbers alone, for every robot, target and scheme.",
    )


def unseen_rows(found: FoundRecipes) -> Statement:
    """The recipe in use on tables with which it was not chosen."""
    found.full()
    tables = [table.name for table in TABLES if table.name not in RECIPES[IN_USE.name].sight]
    before, after = found.means(PRESENT.name), found.means(IN_USE.name)
    changed = {name for name in tables if abs(before[name] - after[name]) > SAME}
    better = {name for name in changed if after[name] < before[name]}
    return Statement(
        "The camera above the platform, the view straight ahead and the other anchor points were "
        f"chosen with rows of {RECIPES[IN_USE.name].sight} in sight; the other tables confirm it.",
        "shares",
        "mean absolute difference in points before and after: "
        + ", ".join(f"{name} {before[name]:.1f} {after[name]:.1f}" for name in tables),
        verdict(changed == better, bool(better)),
        f"Confirmed: no other table gets worse by more than {SAME:g} points.",
    )


def reasons(found: FoundRecipes) -> Statement:
    """Why tables are not met."""
    found.full()
    some = found.reasons()
    good = [reason.explained for reason in some]
    return Statement(
        f"Of each table above {MET:g} points, rows of the bounds that are missed are ruled out by "
        "printed numbers or by the definition.",
        "(3.27), 3.3.1",
        "; ".join(
            f"{r.recipe} {r.table} {r.mean:.1f}: {', '.join(r.rows) or 'none'} ruled out, other "
            f"bounds {r.rest:.1f}, {'' if r.explained else 'not '}explained"
            for r in some
        )
        or "no table is above",
        verdict(all(good), any(good)),
        "The rows stand in the table of reasons. A table counts as explained if the rows of its "
        f"other bounds are off by at most {MET:g} points.",
    )


def rising(found: FoundRecipes) -> Statement:
    """Larger bounds."""
    bad = [(table.name, *row) for table in TABLES for row in rising_rows(table)]
    count = sum(len(rows) - 1 for table in TABLES for rows in table.rows.values())
    return Statement(
        "A larger bound does not leave a larger workspace.",
        "(3.27)",
        f"{len(bad)} of {count} steps from a printed row to the next leave more"
        + "".join(f"; {name} {bound} {low:g} to {high:g}" for name, bound, low, high in bad),
        verdict(not bad, len(bad) < count),
        "From the printed numbers alone.",
    )


def common_exits(found: FoundRecipes) -> Statement:
    """Rows that cannot have exit points that are wrong in common."""
    pairs = [pair for table in TABLES for pair in covering_pairs(table)]
    bad = [pair for pair in pairs if pair.less]
    words = []
    for name in dict.fromkeys(pair.table for pair in bad):
        mine = [pair for pair in bad if pair.table == name]
        worst = max(mine, key=lambda pair: pair.second - pair.first)
        words.append(
            f"{name} {len(mine)}, most at r_A = {worst.r_A:g} m {worst.first:.1f} %, r_bp = "
            f"{worst.r_bp:g} m {worst.second:.1f}"
        )
    return Statement(
        "A common shift of the exit points by r is an error of the platform's place of at most "
        "r + 0.025 m at the baseline, so with such errors r_A = r leaves at least as much.",
        "(3.27)",
        f"{len(bad)} of {len(pairs)} printed rows leave less: {'; '.join(words)}",
        verdict(not bad, len(bad) < len(pairs)),
        "So exit points were not wrong in common at these rows, whatever the target. From the "
        "printed numbers alone.",
    )


def points_together(found: FoundRecipes) -> Statement:
    """Ways in which points may be wrong, against rows of exit and anchor points together."""
    found.full()
    words, good = [], []
    for table in TABLES:
        means = {
            (bound, way): _bound_mean(found.recipes[f"points-{way}"], table.name, bound)
            for bound, way in product(("r_A", "r_B"), DIRECTIONS)
        }
        both = {way: max(means["r_A", way], means["r_B", way]) for way in DIRECTIONS}
        best = min(both, key=lambda way: both[way])
        good.append(both[best] <= MET)
        words.append(f"{table.name} {best} {means['r_A', best]:.1f} and {means['r_B', best]:.1f}")
    return Statement(
        "Exit and anchor points are wrong in the same way in all tables.",
        "3.3.1",
        "best way by table, mean difference of the rows of r_A and of r_B in points: "
        + ", ".join(words),
        verdict(all(good), any(good)),
        f"Ways: {', '.join(DIRECTIONS)}. Met: both means at most {MET:g} points.",
    )


def anchor_points(found: FoundRecipes) -> Statement:
    """The robot of A.11."""
    found.full()
    whole = [name for name, share in found.arrangements.items() if share > NEARLY_WHOLE]
    kept = {
        name: next(
            row.shares[RULES[0]]
            for row in found.recipes[name].rows
            if (row.table, row.bound, row.value) == ("A.11", "r_bp", 0.03)
        )
        for name in ("present", "kept-cables")
    }
    words = []
    for name in dict.fromkeys(row.arrangement for row in found.limits if row.table == "A.11"):
        rows = [row for row in found.limits if (row.table, row.arrangement) == ("A.11", name)]
        bad = [row for row in rows if row.excluded]
        words.append(f"{name} {len(bad)} of {len(rows)}")
    return Statement(
        "The fully constrained ACROBOT has the exit points of table 3.1 and the anchor points of "
        "table A.1, by their numbers.",
        "97.0 % at the baseline of A.11",
        f"{kept['present']:.1f} % at the baseline by the numbers of both tables, "
        f"{kept['kept-cables']:.1f} with the cables of the suspended robot; more than "
        f"{NEARLY_WHOLE:g} in {len(whole)} of {len(found.arrangements)} arrangements: "
        f"{'; '.join(f'{name} {found.arrangements[name]:.1f}' for name in whole)}. Rows of r_A and "
        f"r_B that print more than any target leaves: {', '.join(words)}",
        verdict(kept["present"] > NEARLY_WHOLE, bool(whole)),
        "Arrangements: which points the cables from above hold, and the corner, relative to that "
        "of the exit point, of cables from above; of those from the floor.",
    )


def exchanged_cables(found: FoundRecipes) -> Statement:
    """The exchange in table 3.1 that the rows of one bound choose, and the other rows."""
    found.full()
    means, used = exchange_means(found.exchanges), exchange_name(*EXCHANGE)
    rest = other_rows(found.recipes[EXCHANGED_CABLES.name])
    best = next(iter(means))
    first = ", ".join(f"{name} {mean:.1f}" for name, mean in list(means.items())[:4])
    chosen = means[used] <= means[best] + SAME
    return Statement(
        "Table 3.1 has two exit points of cables from above in each other's place, and the goal is "
        f"the centre: what the rows of {CHOOSING_BOUND} of A.11 choose, its other rows confirm.",
        f"{len(means) - 1} exchanges of two cables, and none",
        f"mean difference over the rows of {CHOOSING_BOUND} in points: {first}; as printed "
        f"{means[PRINTED]:.1f}. The {len(rest)} rows of other bounds, without the baseline, with "
        f"{used}: mean {np.mean(rest):.1f}, largest {max(rest):.1f}",
        verdict(chosen and float(np.mean(rest)) <= MET, chosen),
        f"Confirmed: {used} is the best or as good, within {SAME:g} points, and the other rows are "
        f"off by at most {MET:g} points. A2 A8 and A4 A6 are mirror images, which the table does "
        "not tell apart. The goal was chosen with all rows in sight.",
    )


def _bound_mean(study: RecipeStudy, table: str, bound: str) -> float:
    rows = [row for row in study.rows if (row.table, row.bound) == (table, bound)]
    return float(np.mean([abs(row.shares[RULES[0]] - row.published) for row in rows]))


RECIPE_CHECKS: tuple[Callable[[FoundRecipes], Statement], ...] = (
    best_recipe, unseen_rows, reasons, spheres, shifts, common_exits, rising, points_together,
    anchor_points, exchanged_cables,
)  # fmt: skip
"""All of them."""


def recipe_statements(found: FoundRecipes, quick: bool) -> list[Statement]:
    """Statements for which there are rows; of the `quick` form the others' names."""
    return evaluate_checks(RECIPE_CHECKS, found, quick)
