"""What a mechanism's file needs and a CASPR model lacks: assumed here, each with its reason."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from cdpr_drake.formats.assumptions import (
    RETARDATION,
    STEEL_DENSITY,
    STEEL_ROPE_MODULUS,
    WEIGHTS,
    WORKING_STRESS,
    CompletedDraft,
)
from cdpr_drake.formats.caspr import TOOL
from cdpr_drake.formats.caspr_mechanism import (
    initial_joints,
    limit_remarks,
    link_names,
)
from cdpr_drake.formats.caspr_trees import GRAVITY, CasprCable, CasprTree

WORLD = "world"


def complete_tree(tree: CasprTree, name: str) -> CompletedDraft:
    """The mechanism's file of a CASPR model, with what the model lacks filled in.

    Args:
        tree: The model.
        name: Name of the mechanism, and of the file of its bodies beside, `NAME.xml`.
    """
    assumed: dict[str, str] = {}
    remarks = [*tree.remarks, *limit_remarks(tree), *_renamed(tree)]
    lower, upper = _tensions(tree, assumed, remarks)
    diameter = float(np.sqrt(4.0 * upper / (np.pi * WORKING_STRESS)))
    given = {cable.diameter for cable in tree.cables}
    if len(given) == 1 and None not in given:  # one for all is that of the section
        diameter = float(next(iter(given)) or diameter)
    else:
        assumed["cable.diameter"] = (
            f"{diameter:.6g}, {WORKING_STRESS / 1e6:g} MPa at the largest tension"
        )
    density = float(STEEL_DENSITY * np.pi * diameter**2 / 4.0)
    moduli = [_modulus(cable, diameter) for cable in tree.cables]
    modulus = moduli[0]
    if modulus is None or any(other != modulus for other in moduli):
        modulus = STEEL_ROPE_MODULUS
    if None in moduli:
        assumed["cable.youngs_modulus"] = f"{STEEL_ROPE_MODULUS:.6g}, steel wire rope"
    assumed["cable.linear_density"] = f"{density:.6g}, solid steel of that diameter"
    assumed["cable.retardation_time"] = f"{RETARDATION:g}, a few per cent of critical damping"
    words = [f"{key}: {value}" for key, value in assumed.items()] + remarks
    content: dict[str, Any] = {
        "name": name,
        "title": f"{tree.name} of {TOOL.partition(' ')[0]}",
        "mechanism": f"{name}.xml",
        "home": {"joints": initial_joints(tree)},
        "cable": {
            "youngs_modulus": modulus,
            "diameter": diameter,
            "linear_density": density,
            "retardation_time": RETARDATION,
        },
        "tension_bounds": {"lower": lower, "upper": upper},
        "cables": [_cable(cable, tree, diameter, modulus) for cable in tree.cables],
        "assumptions": f"From {TOOL}. "
        + " ".join(word if word.endswith(".") else word + "." for word in words),
    }
    return CompletedDraft(content, _given(tree), assumed, tuple(remarks))


def _given(tree: CasprTree) -> tuple[str, ...]:
    """Keys that the model has."""
    keys = {
        "mechanism": True, "home.joints": True, "cables[].name": True, "cables[].exit_point": True,
        "cables[].exit_frame": True, "cables[].anchor_point": True, "cables[].anchor_frame": True,
        "cables[].via": any(len(cable.links) > 2 for cable in tree.cables),
        "cables[].pulley_radius": any(cable.pulley_radius for cable in tree.cables),
        "cables[].swivel_axis": any(cable.pulley_radius for cable in tree.cables),
        "cable.youngs_modulus": any(cable.stiffness for cable in tree.cables),
        "cable.diameter": any(cable.diameter for cable in tree.cables),
        "tension_bounds.lower": any(cable.lower is not None for cable in tree.cables),
        "tension_bounds.upper": any(cable.upper is not None for cable in tree.cables),
    }  # fmt: skip
    return tuple(key for key, value in keys.items() if value)


def _renamed(tree: CasprTree) -> list[str]:
    """Links that are not called as in the file, in one sentence, if any; blanks are no matter."""
    found = [
        f"{link.name!r} is {name}"
        for link, name in zip(tree.links, link_names(tree), strict=True)
        if re.sub(r"\s+", "_", link.name) != name
    ]
    return [f"Links have other names: {', '.join(found)}."] if found else []


def _tensions(tree: CasprTree, assumed: dict[str, str], remarks: list[str]) -> tuple[float, float]:
    lowers = [cable.lower for cable in tree.cables if cable.lower is not None]
    uppers = [cable.upper for cable in tree.cables if cable.upper is not None]
    if len({*lowers}) > 1 or len({*uppers}) > 1:
        ranges = [
            f"{min(values, default=0.0):g}..{max(values, default=0.0):g}"
            for values in (lowers, uppers)
        ]
        remarks.append(
            f"Limits differ from cable to cable, lower {ranges[0]}, upper {ranges[1]} N; a "
            "mechanism here has one pair, and got the largest lower and the smallest upper one."
        )
    lower = max(lowers, default=0.0)
    if not lowers:
        assumed["tension_bounds.lower"] = "0, slack allowed"
    if uppers:
        return lower, min(uppers)
    weight = GRAVITY * sum(link.mass for link in tree.links)
    upper = max(WEIGHTS * weight, 2.0 * lower, 1.0)
    assumed["tension_bounds.upper"] = f"{upper:.6g}, {WEIGHTS:g} weights of all links"
    return lower, upper


def _modulus(cable: CasprCable, common: float) -> float | None:
    """Young's modulus with which a cable is as stiff as the model says; None: it says nothing."""
    if cable.stiffness is None:
        return None
    return float(cable.stiffness / (np.pi * (cable.diameter or common) ** 2 / 4.0))


def _cable(cable: CasprCable, tree: CasprTree, diameter: float, modulus: float) -> dict[str, Any]:
    frames = (WORLD, *link_names(tree))
    ends = [
        (frames[number], [float(value) for value in point])
        for number, point in zip(cable.links, cable.points.T, strict=True)
    ]
    item: dict[str, Any] = {"name": cable.name, "exit_point": ends[0][1]}
    if cable.links[0]:
        item["exit_frame"] = ends[0][0]
    if len(ends) > 2:
        item["via"] = [{"frame": frame, "point": point} for frame, point in ends[1:-1]]
    item |= {"anchor_point": ends[-1][1], "anchor_frame": ends[-1][0]}
    if cable.pulley_radius:
        item["pulley_radius"] = float(cable.pulley_radius)
        item["swivel_axis"] = [float(value) for value in cable.entry]
    own = {}
    if cable.diameter is not None and cable.diameter != diameter:
        own["diameter"] = float(cable.diameter)
    stiff = _modulus(cable, diameter)
    if stiff is not None and stiff != modulus:
        own["youngs_modulus"] = stiff
    if own:
        item["material"] = own
    return item
