"""The subcommands of `cdpr`: a row each, in the order of the help."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Command(NamedTuple):
    """A subcommand.

    Attributes:
        group: Heading of the help under which it stands.
        verb: Module and function that answers it.
        line: First line of the function's docstring, so that the help imports no verb.
        examples: Lines to try or to change.
        instead: Other verbs by the options with which they are called instead.
    """

    group: str
    verb: str
    line: str
    examples: tuple[str, ...]
    instead: Mapping[str, str] = MappingProxyType({})


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
    "workspace": Command(
        "Analyse", f"{_VERBS}.workspaces.workspace:compute_workspace",
        "Finds where a robot can work: kinds of workspaces, their intersection, and measures.",
        ("cdpr workspace acrobot_large",
         "cdpr workspace acrobot_large --kind static,interference-free --certify"),
    ),
    "stability": Command(
        "Analyse", f"{_VERBS}.workspaces.stability:assess_stability",
        "Finds where a visual servo is stable (Z), the platform can be held (S), and both (SZ).",
        ("cdpr stability acrobot_large", "cdpr stability acrobot_large --scheme pbvs --json"),
        {"along": f"{_VERBS}.simulation.stability_files:assess_run"},
    ),
    "notebooks": Command(
        "Tools", f"{_VERBS}.front.scenarios:load_scenario", "Lists notebooks, or copies them.",
        ("cdpr notebooks", "cdpr notebooks my_notebooks"),
    ),
}  # fmt: skip
