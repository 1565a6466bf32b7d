"""Options of `cdpr plan --proven`, and what it prints of such a motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import parse_numbers, parse_pose
from cdpr_drake.errors import CdprError, accepted_names
from cdpr_drake.planning.path_in_sets import METHODS

Proven = Annotated[
    bool,
    typer.Option(
        "--proven",
        help="The path is free, and proven at every instant: in sets of poses that are proven.",
    ),
]
LeastTime = Annotated[
    bool, typer.Option("--time", help="With --proven: least time in place of least length.")
]
Acceleration = Annotated[
    str | None,
    typer.Option(
        help="With --proven: the motion stays within accelerations a or ax,ay,az of Po, any "
        "of which the cables are proven to give; 0: poses only; without, 0.25, or 0 where the "
        "platform turns [m/s^2]. Where it turns: a,alpha, of the centre of mass and about it, with "
        "gyroscopic terms [m/s^2, rad/s^2]."
    ),
]
Method = Annotated[
    str | None,
    typer.Option(
        help="With --proven: how sets are chosen: sequences (without this option), short ones from "
        "set to set, or gcs, by Drake's graph of convex sets, to compare.",
        autocompletion=words_among(METHODS),
    ),
]
Boxes = Annotated[
    int | None, typer.Option(help="With --proven: boxes of poses that are judged, at most.")
]


@dataclass(frozen=True)
class ProvenWords:
    """What users wrote of a proven motion; None: nothing."""

    start: str | None
    goal: str | None
    clearance: float | None
    obstacles: Path | None
    time: bool
    acceleration: str | None
    boxes: int | None
    method: str | None

    def given(self) -> list[str]:
        """Names of the options that were given and belong to --proven alone."""
        found = {"--time": self.time or None, "--acceleration": self.acceleration,
                 "--boxes": self.boxes, "--method": self.method}  # fmt: skip
        return [name for name, value in found.items() if value is not None]

    def asked(self) -> dict[str, Any]:
        """What is asked, as `plan_proven_motion` takes it.

        Raises:
            CdprError: Something is missing or not accepted; names the option.
        """
        found: dict[str, Any] = {"least": "time" if self.time else "length"}
        for option, words in (("--from", self.start), ("--to", self.goal)):
            if words is None:
                raise CdprError(f"{option}: found none with --proven; accepted: a pose")
        for name in ("clearance", "obstacles", "boxes", "method"):
            if (value := getattr(self, name)) is not None:
                found[name] = value
        if self.boxes is not None and self.boxes < 1:
            raise CdprError(f"--boxes: found {self.boxes}; accepted: at least 1")
        if self.method is not None and self.method not in METHODS:
            raise CdprError(
                f"--method: found {self.method!r}; {accepted_names(self.method, METHODS)}"
            )
        if self.acceleration is not None:
            meaning = "a or ax,ay,az or a,alpha, each above 0, or 0 [m/s^2, rad/s^2]"
            numbers = parse_numbers("--acceleration", self.acceleration, (1, 2, 3), meaning)
            if min(numbers) <= 0.0 and numbers != [0.0]:
                raise CdprError(f"--acceleration: found {self.acceleration!r}; accepted: {meaning}")
            if len(numbers) == 2:
                numbers = [*[numbers[1]] * 3, *[numbers[0]] * 3]
            found["accelerations"] = numbers[0] if len(numbers) == 1 else numbers
        ends = (("start", "--from", self.start), ("goal", "--to", self.goal))
        return found | {name: one_pose(option, words or "") for name, option, words in ends}

    def as_dict(self) -> dict[str, object]:
        """For JSON, by the names of the options."""
        return {
            "from": self.start, "to": self.goal, "clearance": self.clearance,
            "obstacles": None if self.obstacles is None else str(self.obstacles),
            "time": self.time, "acceleration": self.acceleration, "boxes": self.boxes,
            "method": self.method,
        }  # fmt: skip


def one_pose(option: str, words: str) -> Any:
    """A pose of an option; raises as `parse_pose`, under its name."""
    try:
        return parse_pose(words)
    except CdprError as problem:
        raise CdprError(str(problem).replace("--pose", option, 1)) from problem


def print_proven(console: Console, told: dict[str, Any]) -> None:
    """Says how long the motion is, what is proven of it, and what is not."""
    proven, time = told["proven"], told["least"] == "time"
    unit = "s" if time else "m"
    console.print(
        f"{told['robot']}: {told['duration_s']:.4f} s along {told['path_length_m']:.4g} m, in "
        f"{len(told['stretches'])} of {told['sets']['count']} proven sets"
    )
    console.print(
        f"least {told['least']}: {told['cost']:.4g} {unit}, no less than "
        f"{told['lower_bound']:.4g} {unit} in these sets; straight {told['straight_m']:.4g} m"
    )
    what = "the motion" if proven["motion"] else "the path" if proven["path"] else "CABLES ALONE"
    console.print(f"proven at every instant: {what}")
    for wait in told.get("waits", []):
        console.print(f"waits from {wait['from_s']:.4g} to {wait['to_s']:.4g} s")
    for words in proven["of"]:
        console.print(f"  {words}")
    for words in proven["not_of"]:
        console.print(f"  not proven: {words}")
    wrong = sum(told["judged_infeasible"].values())
    console.print(
        f"{told['judged_samples']} samples by the checks of poses: "
        f"{'all kinds hold' if not wrong else f'{wrong} FAIL'}"
    )
