"""What helps to find and begin a command: groups of the help, first steps, two examples each."""

from __future__ import annotations

COMMANDS: dict[str, tuple[str, str, str]] = {
    "workspace": (
        "Analyse",
        "cdpr workspace acrobot_large",
        "cdpr workspace acrobot_large --kind static,interference-free --certify",
    ),
    "stability": (
        "Analyse",
        "cdpr stability acrobot_large",
        "cdpr stability acrobot_large --scheme pbvs --json",
    ),
}
"""Subcommands in the order of the help: group, and two lines to try or to change."""


def groups() -> dict[str, list[str]]:
    """Names of subcommands by what they are for."""
    found: dict[str, list[str]] = {}
    for name, (group, *_) in COMMANDS.items():
        found.setdefault(group, []).append(name)
    return found


FIRST_STEPS: tuple[tuple[str, str], ...] = (
    ("cdpr robots", "robots that come with the package"),
    ("cdpr simulate", "a visual servo, from rendered images to winches; opens as replay.html"),
    ("cdpr tension acrobot_large", "tensions that hold a robot at its home"),
    ("cdpr workspace acrobot_large", "where it can work"),
    ("cdpr new robot mine", "a commented file of a robot of your own"),
)
"""What `cdpr` alone shows."""


def examples_of(name: str) -> str:
    """Examples of a subcommand, for the end of its help, as Markdown."""
    lines = "\n\n".join(f"`{line}`" for line in COMMANDS[name][1:])
    return f"Examples:\n\n{lines}"


def first_steps() -> str:
    """What `cdpr` alone shows."""
    width = max(len(line) for line, _ in FIRST_STEPS)
    steps = "\n".join(f"  {line:<{width}}  {words}" for line, words in FIRST_STEPS)
    title = "Cable-driven parallel robots in Drake. To begin:"
    return f"{title}\n\n{steps}\n\ncdpr --help lists the rest."
