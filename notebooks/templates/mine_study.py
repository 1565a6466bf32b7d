"""The study `mine`: run this file for its table and figure, and its test to see that it holds."""

import cdpr_drake as cdpr
from cdpr_drake.analyses.studies.framework import Case, Cell, Finding, Study, Summary
from cdpr_drake.analyses.studies.framework.statement import OURS, statement
from cdpr_drake.analyses.visualization import new_figure

ROBOT = "acrobot_large"
MASSES = (1.0, 1.5, 2.0, 2.5, 3.0)  # [kg]


def cases(form):
    """What is measured: a case for each mass, two of them in the quick form."""
    for mass in MASSES[::4] if form.quick else MASSES:
        yield Case(name=f"{mass:g}_kg", keys={"mass_kg": mass})


def measure(case, seed):
    """The row of a case: replace this by what you measure. The unit ends a column's name."""
    solution = cdpr.solve_tensions(ROBOT, mass=case.keys["mass_kg"])
    return {"largest_n": float(solution.tensions.max())}


@statement(
    "A heavier platform needs more tension.", "", rule="no largest tension falls", basis=OURS
)
def more(runs):
    """What has to hold of all rows."""
    largest = runs["largest_n"]
    return Finding(
        found=f"{largest[0]:.1f} to {largest[-1]:.1f} N",
        held=(largest[1:] >= largest[:-1]).tolist(),
    )


def figure(runs):
    """Largest tension over mass."""
    drawn, axes = new_figure(1, 1, (6.0, 4.0), "Largest tension at home")
    axes.plot(runs["mass_kg"], runs["largest_n"], marker="o", color="black")
    axes.set(xlabel="mass of the platform [kg]", ylabel="largest tension [N]")
    return drawn


STUDY = Study(
    name="mine",
    title="Tensions of heavier platforms",
    cases=cases,
    measure=measure,
    checks=[more],
    tables=[Summary("tensions", ("mass_kg",), {"largest [N]": Cell("mean", "largest_n", ".1f")})],
    figures={"tensions": figure},
)

if __name__ == "__main__":  # workers are new processes, which import this file
    found = cdpr.run_study(STUDY, f"{STUDY.name}_results")
    print(found)
    print("largest tensions [N]:", found.result.runs["largest_n"])
