"""The study `mine`: run this file for its table and figure, and its test to see that it holds."""

from functools import partial

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame import new_figure

ROBOT = "acrobot_large"
MASSES = (1.0, 1.5, 2.0, 2.5, 3.0)  # [kg]


def measure(mass_kg):
    """The other columns of a row: replace this by what you measure. Units end a column's name."""
    solution = cdpr.solve_tensions(ROBOT, mass=mass_kg)
    return {"largest_n": float(solution.tensions.max())}


def cases(form):
    """A row for each mass; two of them in the quick form."""
    for mass in MASSES[::4] if form.quick else MASSES:
        yield cdpr.Case(keys={"mass_kg": mass}, call=partial(measure, mass))


def tensions(rows):
    """Largest tension over mass."""
    figure, axes = new_figure(1, 1, (6.0, 4.0), "Largest tension at home")
    axes.plot(rows["mass_kg"], rows["largest_n"], marker="o", color="black")
    axes.set(xlabel="mass of the platform [kg]", ylabel="largest tension [N]")
    return figure


STUDY = cdpr.Study(
    name="mine",
    title="Tensions of heavier platforms",
    cases=cases,
    tables={"Largest tensions": lambda rows: rows[["mass_kg", "largest_n"]]},
    figures={"tensions": tensions},
    facts=[
        {
            "name": "more", "says": "A heavier platform needs more tension.", "basis": "ours",
            "parts": [{"of": "largest_n", "by": {"mass_kg": [1.0, 3.0]}, "rising": 1.0}],
        }
    ],
)  # fmt: skip

if __name__ == "__main__":  # workers are new processes, which import this file
    result = cdpr.run_study(STUDY, f"{STUDY.name}_results")
    print(result)
    print("largest tensions [N]:", result.rows["largest_n"].tolist())
