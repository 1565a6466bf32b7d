"""The subcommands of `cdpr`: a row each, in the order of the help."""

from __future__ import annotations

from typing import NamedTuple


class Command(NamedTuple):
    """A subcommand.

    Attributes:
        group: Heading of the help under which it stands.
        verb: Module and function that answers it.
        line: First line of the function's docstring, so that the help imports no verb.
        examples: Lines to try or to change.
    """

    group: str
    verb: str
    line: str
    examples: tuple[str, ...]


FIRST_STEPS = {
    "cdpr robots": "robots that come with the package",
    "cdpr simulate": "a visual servo, from rendered images to winches; opens as replay.html",
    "cdpr tension acrobot_large": "tensions that hold a robot at its home",
    "cdpr workspace acrobot_large": "where it can work",
    "cdpr new robot mine": "a commented file of a robot of your own",
}
"""What `cdpr` alone shows."""

_VERBS = "cdpr_drake.analyses"

COMMANDS = {
    "environments": Command(
        "Run", f"{_VERBS}.environments:list_environments",
        "Lists the Gymnasium environments, with the sizes of action and observation for a robot.",
        ("cdpr environments",
         "cdpr environments Reach --robot acrobot_small --picture reach.png"),
    ),
    "view": Command(
        "Robots and scenarios", f"{_VERBS}.view:view",
        "Shows a robot or a mechanism at its home, held by its cables, in Meshcat.",
        ("cdpr view acrobot_large", "cdpr view two_platforms"),
    ),
    "tension": Command(
        "Analyse", f"{_VERBS}.tensions:solve_tensions",
        "Finds cable tensions that hold the platform at a pose, or proves that there are none.",
        ("cdpr tension acrobot_large",
         "cdpr tension acrobot_large --pose 0.35,-0.27,0.45 --method all"),
    ),
    "static": Command(
        "Analyse", f"{_VERBS}.statics.static:solve_static",
        "Computes lengths, tensions, stiffness, vibrations and sag of a robot at rest.",
        ("cdpr static acrobot_large",
         "cdpr static caroca --pose 0,0,1.5 --cable-model catenary"),
    ),
    "equilibria": Command(
        "Analyse", f"{_VERBS}.equilibria:find_equilibria",
        "Finds all poses of rest, stable or not, with any cables slack, for lengths or a position.",
        ("cdpr equilibria grab_three --position 0.6,1.16,-1.5",
         "cdpr equilibria grab_four --position 0.6,1.16,-1.5 --taut C1,C2,C3"),
    ),
    "notebooks": Command(
        "Tools", f"{_VERBS}.front.scenarios:load_scenario", "Lists notebooks, or copies them.",
        ("cdpr notebooks", "cdpr notebooks my_notebooks"),
    ),
}  # fmt: skip
