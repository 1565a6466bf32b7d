"""What the servoing thesis states about spatial robots, beside what was found."""

from __future__ import annotations

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import SOURCE, Finding, statement
from cdpr_drake.analyses.studies.stability_ranges.planar_statements import falling
from cdpr_drake.analyses.studies.stability_ranges.question import (
    FALLS,
    NESTED,
    SPATIAL_CAMERA,
    SPATIAL_ROBOT,
    SPATIAL_VISION,
    falls,
    found,
    group,
    limits_of,
    listed,
    pairs,
)
from cdpr_drake.analyses.studies.stability_ranges.vision import PUBLISHED_OBJECT

SECTION = "servoing thesis 3.2.2"

PLACE_TOLERANCE = 0.05
"""Within which the largest error of the object's place counts as met [m]."""

SAME = 0.1
"""What changes less than this share, a limit does not affect."""

TESTED_PLACE = 0.2
"""Largest error of the camera's position that the thesis tried [m]."""

ACROSS = f"Across: {NESTED[0].lower()}{NESTED[1:]} Heights are not nested."


@statement(
    "Spatial I: the object's place may be off by at most 1.5 m.",
    f"{PUBLISHED_OBJECT['place']:g} m, figure 3.3",
    source=SECTION,
    rule=f"within {PLACE_TOLERANCE:g} m",
    cause=SOURCE,
)
def object_place(runs: Runs) -> Finding:
    """Largest error of the object's position of analysis I."""
    some = group(runs, SPATIAL_VISION, "place")
    exact = [found(run) for run in some if not run["d_theta_s_deg"]]
    printed = PUBLISHED_OBJECT["place"]
    return Finding(
        found=f"{min(exact):.2f} m at any theta up to 160 deg without rotation error; at theta = "
        "0: "
        + ", ".join(
            f"{found(run):.2f} m with {run['d_theta_s_deg']:g} deg"
            for run in some
            if run["theta_u_deg"] == 0.0 and run["d_theta_s_deg"]
        ),
        held=[abs(max(exact) - printed) < PLACE_TOLERANCE],
        some=max(exact) >= printed,
        why="The exact limit is 2 sqrt(min eig sym(L_hat' L)) <= 2 m. 1.5 m is safe, not the "
        "limit.",
    )


@statement(
    "Spatial I: theta may be at most 160 deg, and its error at most 90 deg.",
    "160 deg and 90 deg",
    source=SECTION,
    rule="theta is at most as printed, whatever its error",
    cause=SOURCE,
)
def object_turn(runs: Runs) -> Finding:
    """Largest theta and error of theta of analysis I."""
    limits = {
        run["d_theta_s_deg"]: found(run) for run in group(runs, SPATIAL_VISION, "turn")
    }  # fmt: skip
    return Finding(
        found=", ".join(
            f"{turn:g} deg with an error of {error:g} deg" for error, turn in limits.items()
        ),
        held=[max(limits.values()) <= PUBLISHED_OBJECT["turn"]],
        some=min(turn + error for error, turn in limits.items()) > 170.0,
        why="What counts is their sum: below 180 deg; beyond, theta u and its estimate may point "
        "in opposite directions. 160 deg go with errors below 20 deg, 90 deg with theta below 90 "
        "deg.",
    )


@statement(
    "Spatial II i: stable as long as the difference between e and its estimate is not larger than "
    "e.",
    "as long as",
    source=SECTION,
    rule="the largest difference that is found is not smaller than e",
    cause=SOURCE,
)
def difference(runs: Runs) -> Finding:
    """II i."""
    some = group(runs, SPATIAL_CAMERA, "error")
    return Finding(
        found="largest difference " + pairs(some, "error", "m"),
        held=[found(run) >= run["error_m"] for run in some],
        why="Read as lengths. The condition is enough while e is shorter than the limit found, "
        "which is about 2 m less what the camera's errors take, and it is not needed: for a short "
        "e the difference may be many times longer.",
    )


rotational_range = falling(
    "rotational_range",
    "Spatial II ii: the smaller that difference, the larger the rotational range.",
    "not in numbers", section=SPATIAL_CAMERA, which="r_s", limit="r_s", words="turn of the camera ",
)  # fmt: skip


@statement(
    "Spatial II iii: the error of the camera's place has no effect up to 0.2 m.",
    "none",
    source=SECTION,
    rule="it takes less than 1 deg",
    cause=SOURCE,
)
def spatial_camera_place(runs: Runs) -> Finding:
    """II iii."""
    some = group(runs, SPATIAL_CAMERA, "r_pc")
    first = found(some.rows[0])
    least = min(found(run) for run in some if limits_of(run).get("r_pc", 0.0) <= TESTED_PLACE)
    return Finding(
        found="turn of the camera " + pairs(some, "r_pc", "m"),
        held=[first - least < 1.0],
        some=least > (1.0 - SAME) * first,
        why="It acts as the same error of the object's place does: little, not nothing.",
    )


@statement(
    "Spatial III i: the smaller the errors of the platform's or the camera's place, the larger the "
    "range of rotation, above all about z.",
    "not in numbers",
    source=SECTION,
    rule=f"{FALLS}; the range about z loses more",
    cause=SOURCE,
)
def errors_and_rotation(runs: Runs) -> Finding:
    """III i."""
    less: list[bool] = []
    about_z, words = [], []
    for known, heading in (("", "coarse knowledge"), (" well", "good knowledge of all the rest")):
        for name in ("r_bp", "r_pc"):
            some = [group(runs, SPATIAL_ROBOT, f"{name} {way}{known}") for way in ("psi", "tilt")]
            less += map(falls, some)
            losses = [found(one.rows[0]) - found(one.rows[-1]) for one in some]
            about_z.append(losses[0] > losses[1])
            words.append(
                f"{heading}, {name} of 0, 0.05, 0.1, 0.2 m: about z {listed(some[0])}, about x and "
                f"y {listed(some[1])} deg"
            )
    return Finding(
        found="; ".join(words),
        held=[*less, *about_z],
        some=any(less),
        why="The range about z loses most where the rest is known coarsely; with good knowledge "
        "that about x and y loses as much.",
    )


turn_and_tilt = falling(
    "turn_and_tilt",
    "Spatial III ii: the smaller the rotation about z, the larger that about x and y.",
    "not in numbers", section=SPATIAL_ROBOT, which="psi tilt", limit="psi",
)  # fmt: skip


@statement(
    "Spatial III iii: the closer the platform to the origin, on the ground in the middle, the "
    "larger the tolerated error of its place.",
    "not in numbers",
    source=SECTION,
    rule=FALLS,
    cause=SOURCE,
)
def place_error(runs: Runs) -> Finding:
    """III iii."""
    across, up = (group(runs, SPATIAL_ROBOT, name) for name in ("place r_bp", "height r_bp"))
    return Finding(
        found=f"across: {pairs(across, 'place', 'm')}; up: {pairs(up, 'high', 'm')}",
        held=[falls(across), falls(up)],
        why=ACROSS,
    )


@statement(
    "Spatial III iv: likewise, the closer to the origin, the larger the range of rotation.",
    "not in numbers",
    source=SECTION,
    rule=FALLS,
    cause=SOURCE,
)
def place_rotation(runs: Runs) -> Finding:
    """III iv."""
    series = {
        "about z, across": (group(runs, SPATIAL_ROBOT, "place psi"), "place"),
        "about x and y, across": (group(runs, SPATIAL_ROBOT, "place tilt"), "place"),
        "about x and y, up": (group(runs, SPATIAL_ROBOT, "height tilt"), "high"),
    }
    return Finding(
        found="; ".join(f"{words}: {pairs(some, name, 'm')}"
                        for words, (some, name) in series.items()),
        held=[falls(some) for some, _ in series.values()],
        why=ACROSS,
    )  # fmt: skip


CHECKS = (
    object_place, object_turn, difference, rotational_range, spatial_camera_place,
    errors_and_rotation, turn_and_tilt, place_error, place_rotation,
)  # fmt: skip
"""All of them, in the order of the thesis."""
