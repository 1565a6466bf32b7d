"""What the servoing thesis states about spatial robots, beside what was found."""

from __future__ import annotations

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.stability_ranges.answers import (
    NESTED,
    FoundRows,
    falls,
    found,
    listed,
    pairs,
)
from cdpr_drake.analyses.studies.stability_ranges.item import (
    SPATIAL_CAMERA,
    SPATIAL_ROBOT,
    SPATIAL_VISION,
)
from cdpr_drake.analyses.studies.stability_ranges.vision import PUBLISHED_OBJECT

SAME = 0.1
"""What changes less than this share, a limit does not affect."""

TESTED_PLACE = 0.2
"""Largest error of the camera's position that the thesis tried [m]."""


def _place(rows: FoundRows, turn: float, error: float) -> float:
    return rows.named(f"spatial-I-{turn:g}-{error:g}").found


def object_place(rows: FoundRows) -> Statement:
    """Largest error of the object's position of analysis I."""
    some = rows.of(SPATIAL_VISION, "place")
    exact = [row.found for row in some if not row.limits["d_theta_s"]]
    printed = PUBLISHED_OBJECT["place"]
    return Statement(
        "Spatial I: the object's place may be off by at most 1.5 m.",
        f"{printed:g} m, figure 3.3",
        f"{min(exact):.2f} m at any theta up to 160 deg without rotation error; at theta = 0: "
        + ", ".join(
            f"{row.found:.2f} m with {row.limits['d_theta_s']:g} deg"
            for row in some
            if row.limits["theta_u"] == 0.0 and row.limits["d_theta_s"]
        ),
        verdict(abs(max(exact) - printed) < 0.05, max(exact) >= printed),
        "The exact limit is 2 sqrt(min eig sym(L_hat' L)) <= 2 m. 1.5 m is safe, not the limit.",
    )


def object_turn(rows: FoundRows) -> Statement:
    """Largest theta and error of theta of analysis I."""
    some = rows.of(SPATIAL_VISION, "turn")
    sums = [row.found + row.limits["d_theta_s"] for row in some]
    largest = max(found(some))
    return Statement(
        "Spatial I: theta may be at most 160 deg, and its error at most 90 deg.",
        "160 deg and 90 deg",
        ", ".join(
            f"{row.found:g} deg with an error of {row.limits['d_theta_s']:g} deg" for row in some
        ),
        verdict(largest <= PUBLISHED_OBJECT["turn"], min(sums) > 170.0),
        "What counts is their sum: below 180 deg; beyond, theta u and its estimate may point in "
        "opposite directions. 160 deg go with errors below 20 deg, 90 deg with theta below 90 deg.",
    )


def difference(rows: FoundRows) -> Statement:
    """II i."""
    some = rows.of(SPATIAL_CAMERA, "error")
    enough = [row.found >= row.limits["error"] for row in some]
    return Statement(
        "Spatial II i: stable as long as the difference between e and its estimate is not larger "
        "than e.",
        "as long as",
        "largest difference " + pairs(some, "error", "m"),
        verdict(all(enough), any(enough)),
        "Read as lengths. The condition is enough while e is shorter than the limit found, which "
        "is about 2 m less what the camera's errors take, and it is not needed: for a short e the "
        "difference may be many times longer.",
    )


def rotational_range(rows: FoundRows) -> Statement:
    """II ii."""
    some = rows.of(SPATIAL_CAMERA, "r_s")
    return Statement(
        "Spatial II ii: the smaller that difference, the larger the rotational range.",
        "not in numbers",
        "turn of the camera " + pairs(some, "r_s", "m"),
        verdict(falls(found(some)), found(some)[-1] < found(some)[0]),
        NESTED,
    )


def spatial_camera_place(rows: FoundRows) -> Statement:
    """II iii."""
    some = rows.of(SPATIAL_CAMERA, "r_pc")
    first, tested = some[0].found, [
        row.found for row in some if row.limits.get("r_pc", 0.0) <= TESTED_PLACE
    ]  # fmt: skip
    return Statement(
        "Spatial II iii: the error of the camera's place has no effect up to 0.2 m.",
        "none",
        "turn of the camera " + pairs(some, "r_pc", "m"),
        verdict(first - min(tested) < 1.0, min(tested) > (1.0 - SAME) * first),
        "It acts as the same error of the object's place does: little, not nothing.",
    )


def errors_and_rotation(rows: FoundRows) -> Statement:
    """III i."""
    less, about_z, words = [], [], []
    for known, heading in (("", "coarse knowledge"), (" well", "good knowledge of all the rest")):
        for name in ("r_bp", "r_pc"):
            turn = rows.of(SPATIAL_ROBOT, f"{name} psi{known}")
            tilt = rows.of(SPATIAL_ROBOT, f"{name} tilt{known}")
            less += [falls(found(turn)), falls(found(tilt))]
            losses = [found(some)[0] - found(some)[-1] for some in (turn, tilt)]
            about_z.append(losses[0] > losses[1])
            words.append(
                f"{heading}, {name} of 0, 0.05, 0.1, 0.2 m: about z {listed(turn)}, about x and y "
                f"{listed(tilt)} deg"
            )
    return Statement(
        "Spatial III i: the smaller the errors of the platform's or the camera's place, the larger "
        "the range of rotation, above all about z.",
        "not in numbers",
        "; ".join(words),
        verdict(all(less) and all(about_z), any(less)),
        "The range about z loses most where the rest is known coarsely; with good knowledge that "
        "about x and y loses as much.",
    )


def turn_and_tilt(rows: FoundRows) -> Statement:
    """III ii."""
    some = rows.of(SPATIAL_ROBOT, "psi tilt")
    return Statement(
        "Spatial III ii: the smaller the rotation about z, the larger that about x and y.",
        "not in numbers",
        pairs(some, "psi", "deg about z"),
        verdict(falls(found(some)), found(some)[-1] < found(some)[0]),
        NESTED,
    )


def place_error(rows: FoundRows) -> Statement:
    """III iii."""
    across, up = rows.of(SPATIAL_ROBOT, "place r_bp"), rows.of(SPATIAL_ROBOT, "height r_bp")
    less = [falls(found(across)), falls(found(up))]
    return Statement(
        "Spatial III iii: the closer the platform to the origin, on the ground in the middle, the "
        "larger the tolerated error of its place.",
        "not in numbers",
        f"across: {pairs(across, 'place', 'm')}; up: {pairs(up, 'high', 'm')}",
        verdict(all(less), any(less)),
        f"Across: {NESTED[0].lower()}{NESTED[1:]} Heights are not nested.",
    )


def place_rotation(rows: FoundRows) -> Statement:
    """III iv."""
    series = {
        "about z, across": (rows.of(SPATIAL_ROBOT, "place psi"), "place"),
        "about x and y, across": (rows.of(SPATIAL_ROBOT, "place tilt"), "place"),
        "about x and y, up": (rows.of(SPATIAL_ROBOT, "height tilt"), "high"),
    }
    less = [falls(found(some)) for some, _ in series.values()]
    return Statement(
        "Spatial III iv: likewise, the closer to the origin, the larger the range of rotation.",
        "not in numbers",
        "; ".join(f"{words}: {pairs(some, name, 'm')}" for words, (some, name) in series.items()),
        verdict(all(less), any(less)),
        f"Across: {NESTED[0].lower()}{NESTED[1:]} Heights are not nested.",
    )


CHECKS = (
    object_place, object_turn, difference, rotational_range, spatial_camera_place,
    errors_and_rotation, turn_and_tilt, place_error, place_rotation,
)  # fmt: skip
"""All of them, in the order of the thesis."""
