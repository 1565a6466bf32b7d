"""Colours, dashes, markers and hatches: one set for figures, replays and studies.

Whatever is drawn keeps its look in every picture: a cable by its number, a configuration by its
number in its study, a role (platform, camera, ...) by its name. The colours can be told apart by
colour-blind readers; dashes, markers and hatches tell what is drawn apart in grey print.

Source of the first colours: M. Okabe, K. Ito, "Color universal design", 2008.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Dash = str | tuple[float, tuple[float, ...]]
"""A line style of matplotlib: a name, or an offset and lengths of dashes and gaps [pt]."""

SOLID: Dash = "-"
DASHED: Dash = "--"
DASH_DOTTED: Dash = "-."
DOTTED: Dash = ":"

COLORS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8c510a", "#e69f00", "#303030",
)  # fmt: skip
DASHES = (SOLID, DASHED, DASH_DOTTED, DOTTED)
MARKERS = ("o", "s", "^", "D", "v", "x", "*", "<", ">", "P", "d", "1", "p", "2", "X", "h")
HATCHES = ("", "///", "...", "xxx", "\\\\\\", "+++", "ooo", "---")


@dataclass(frozen=True)
class Look:
    """How one thing is drawn.

    Attributes:
        color: As #rrggbb.
        dash: Style of its line.
        marker: Symbol on its line, empty for none.
        hatch: Hatch of its bars, empty for none.
    """

    color: str
    dash: Dash = SOLID
    marker: str = ""
    hatch: str = ""


def nth_look(number: int) -> Look:
    """The look of the thing with this number, from 0; colour and marker together repeat after 128.

    Cables, configurations, methods: whatever comes as a list. Markers repeat after 16, as grey
    print has no colours to tell the ninth thing from the first.
    """
    shift = number // len(COLORS)
    return Look(
        COLORS[number % len(COLORS)],
        DASHES[(number + shift) % len(DASHES)],
        MARKERS[(number + number // len(MARKERS)) % len(MARKERS)],
        HATCHES[(number + shift) % len(HATCHES)],
    )


def look_of(name: str, names: Sequence[str]) -> Look:
    """The look of a name by its place among all the names that there are.

    Raises:
        ValueError: It is not among them.
    """
    return nth_look(list(names).index(name))


PLATFORM = Look(COLORS[0], SOLID, "o")
ESTIMATED = Look(COLORS[1], DOTTED, "s")
DESIRED = Look(COLORS[2], DASHED, "*")
CAMERA = Look(COLORS[3], DASH_DOTTED, "D")
SECOND_CAMERA = Look(COLORS[4], DASHED, "d")
TARGET = Look(COLORS[7], SOLID, "X")
IDEAL = Look("#707070", DASHED)
"""The straight line, or whatever a path should be."""
BOUND = Look("#202020", (0.0, (9.0, 3.0)))
"""A bound that something has to keep."""
PUBLISHED = Look("#000000", SOLID, "+")
OUTLINE = Look("#505050")
"""The body of the platform, the frame of the robot."""
SHADED = Look("#d9d9d9")
"""Times in which something does not hold."""
LOST = Look("#e61a1a", SOLID, "", "///")
"""Times, and curves there, in which too few cables hold the platform."""

DISTANCE = Look(COLORS[0], SOLID)
ANGLE = Look(COLORS[1], SOLID)

OUTCOMES = {
    "converged": Look(COLORS[0], SOLID, "o"),
    "target_lost": Look(COLORS[6], DASHED, "s"),
    "timeout": Look(COLORS[1], DASH_DOTTED, "^"),
}
"""Of runs, by how they ended."""
OTHER_OUTCOME = Look(COLORS[3], DOTTED, "x")

VERDICTS = {
    "sampled": Look(COLORS[0], SOLID, "o", HATCHES[0]),
    "searched": Look(COLORS[1], DASHED, "s", HATCHES[1]),
    "certified": Look(COLORS[2], DOTTED, "v", HATCHES[2]),
}
"""Of judgements on stability."""

WORKSPACES = {"neither": "#e8e8e8", "S": "#f0c27b", "Z": "#7ba6d9", "SZ": "#3f8f5f"}
"""Of the parts of a workspace, each darker than the one before."""

SLACK = "#e61a1a"
"""A slack cable in a scene, where colours of tensions have no red."""

UNKNOWN = Look("#999999")
"""Cables of which nobody knows the tension."""

TENSIONS = (
    "#440154", "#463380", "#365d8d", "#26828e", "#1fa187", "#4ac26d", "#a0da39", "#fde725",
)  # fmt: skip
"""From the lowest to the highest tension, after matplotlib's viridis."""


def rgb(color: str) -> tuple[float, float, float]:
    """Red, green, blue of a colour #rrggbb, each from 0 to 1."""
    return tuple(int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5))  # type: ignore[return-value]


DARK_GROUND = "#1d2126"
"""What dark pages and their plots are drawn on."""

LEAST_CONTRAST = 3.0
"""Of a curve against its ground. Source: Web Content Accessibility Guidelines 2.1, 1.4.11."""


def luminance(color: str) -> float:
    """Relative luminance of a colour #rrggbb, from 0 (black) to 1 (white).

    Source: Web Content Accessibility Guidelines 2.1, definition of relative luminance.
    """
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in rgb(color)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    """How far two colours #rrggbb are apart, from 1 (not at all) to 21 (black on white).

    Source: Web Content Accessibility Guidelines 2.1, definition of contrast ratio.
    """
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def on_dark(color: str) -> str:
    """The same colour #rrggbb for a dark page: with so much white that `DARK_GROUND` shows it."""
    for step in range(101):
        share = step / 100.0
        mixed = [round(255.0 * (c + share * (1.0 - c))) for c in rgb(color)]
        shown = "#{:02x}{:02x}{:02x}".format(*mixed)
        if contrast(shown, DARK_GROUND) >= LEAST_CONTRAST:
            return shown
    raise ValueError(f"{color} cannot be shown on {DARK_GROUND}")
