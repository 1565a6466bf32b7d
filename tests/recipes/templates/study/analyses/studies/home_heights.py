"""How high the robots hang at home."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary
from cdpr_drake.analyses.visualization.figure_style import new_figure
from cdpr_drake.models.robot_loader import load_robot


def cases(form: Form) -> Iterator[Case]:
    """A case for each robot; the quick form has one."""
    for name in ("acrobot_large",) if form.quick else ("acrobot_large", "caroca"):
        yield Case(name=name, keys={"robot": name})


def measure(case: Case, seed: int) -> dict[str, Any]:
    """The height of Po above the origin of W."""
    X_WP = load_robot(case.keys["robot"]).home.transform()
    return {"height_m": float(X_WP.translation()[2])}


@statement("Every robot hangs above the floor.", "", rule="above 0 m", basis=OURS)
def above(runs: Runs) -> Finding:
    """Heights of all robots."""
    lowest = runs.smallest("height_m")
    return Finding(found=f"lowest {lowest:.3f} m", held=(runs["height_m"] > 0.0).tolist())


def heights_figure(runs: Runs) -> Figure:
    """A bar for each robot."""
    figure, axes = new_figure(1, 1, (6.0, 4.0), "Heights at home")
    axes.bar(runs.list("robot"), runs["height_m"], color="#4c72b0")
    axes.set(ylabel="height of P above W [m]")
    return figure


STUDY = Study(
    name="home-heights",
    title="How high the robots hang at home",
    cases=cases,
    measure=measure,
    checks=(above,),
    tables=[Summary("home heights", ("robot",), {"height [m]": Cell("mean", "height_m", ".3f")})],
    figures={"heights": heights_figure},
)
