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
    "tension": Command(
        "Analyse", f"{_VERBS}.tensions:solve_tensions",
        "Finds cable tensions that hold the platform at a pose, or proves that there are none.",
        ("cdpr tension acrobot_large",
         "cdpr tension acrobot_large --pose 0.35,-0.27,0.45 --method all"),
    ),
    "plan": Command(
        "Plan and design", f"{_VERBS}.planning.command:plan",
        "Plans a motion within limits of tensions and winches: on a path, a free one, or a proven "
        "one.",
        ("cdpr plan acrobot_large --proven --from 0,0,0.3 --to 0.2,0,0.4",
         "cdpr plan acrobot_large --free --from 0,0,0.3 --to 0.2,0,0.4"),
    ),
    "reconfigure": Command(
        "Plan and design", f"{_VERBS}.design.reconfiguration:reconfigure",
        "Places exit points along rails so that poses or a path are feasible or best, with a "
        "proof.",
        ("cdpr reconfigure acrobot_large --rails rails.yaml --poses 0.2,0,0.4",
         "cdpr reconfigure caroca --rails rails.yaml --path poses.csv"),
    ),
    "design": Command(
        "Plan and design", f"{_VERBS}.design.optimization:optimize_design",
        "Searches for the best points, number of cables, drum and motor of a robot.",
        ("cdpr design acrobot_large --goal capacity-margin",
         "cdpr design acrobot_large --goal static --goal accuracy --quick"),
    ),
    "notebooks": Command(
        "Tools", f"{_VERBS}.front.scenarios:load_scenario", "Lists notebooks, or copies them.",
        ("cdpr notebooks", "cdpr notebooks my_notebooks"),
    ),
}  # fmt: skip
