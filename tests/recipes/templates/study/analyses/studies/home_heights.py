"""How high the robots hang at home."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.study import Case, Form, Frame, Study
from cdpr_drake.analyses.frame.figures import new_figure
from cdpr_drake.models.robot_loader import load_robot


def height(robot: str) -> dict[str, float]:
    """Height of Po above the origin of W at home."""
    return {"height_m": float(load_robot(robot).home.transform().translation()[2])}


def cases(form: Form) -> Iterator[Case]:
    """A row for each robot; the quick form has one."""
    for name in ("acrobot_large",) if form.quick else ("acrobot_large", "caroca"):
        yield Case(keys={"robot": name}, call=partial(height, name))


def heights_figure(rows: Frame) -> Figure:
    """A bar for each robot."""
    figure, axes = new_figure(1, 1, (6.0, 4.0), "Heights at home")
    axes.bar(rows["robot"], rows["height_m"], color="#4c72b0")
    axes.set(ylabel="height of P above W [m]")
    return figure


STUDY = Study(
    name="home-heights",
    title="How high the robots hang at home",
    cases=cases,
    tables={"home heights": lambda rows: rows[["robot", "height_m"]]},
    figures={"heights": heights_figure},
    facts=[
        {
            "name": "above", "says": "Every robot hangs above the floor.", "basis": "ours",
            "parts": [{"of": "height_m", "over": "min", "above": 0}],
        }
    ],
)  # fmt: skip
