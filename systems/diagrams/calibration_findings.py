"""What a run found of the calibration of its two cameras, in words and numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_models import sigmas_of

WORSE, AS_TOLD, OPEN, DOES_NOT_FIT, UNKNOWN = (
    "worse than told", "as told", "open", "does not fit", "nothing learnt",
)  # fmt: skip
"""Judgements: the first three where a calibration is doubted, by its probability; where nobody
doubts it, it fits what is told or does not, whoever else may be to blame for that."""

SURE = 0.95
"""Probability from which on a calibration is judged."""

UNLIKELY_SIGMAS = 3.29
"""Surprise, as deviations of one number, beyond which a calibration does not fit: one in a
thousand is larger."""

NAMES = {"on_board": "on board", "external": "in the world"}


def found_calibrations(row: Array) -> dict[str, dict[str, Any]]:
    """What was found of each camera that was read.

    Args:
        row: As on `fusion_calibration`, shape (30,).

    Returns:
        For `on_board` and `external`: `judged`; `probability_worse`, None where nobody doubts;
        `surprise_sigmas`, how far it is from what is told if it is as told, as deviations of one
        number; `directions`, of six, in which anything was learnt; the error found and its
        standard deviation, `position_m`, `position_deviation_m`, `rotation_rad`,
        `rotation_deviation_rad`.
    """
    found = {}
    for name, numbers in zip(NAMES, np.reshape(row, (2, -1)), strict=True):
        if np.isnan(numbers[-1]):
            continue  # no such camera
        probability, surprise, freedom = numbers[:3]
        sigmas = sigmas_of(float(surprise), int(freedom)) if freedom else None
        turn, shift, turn_deviations, shift_deviations = (
            float(np.linalg.norm(part)) for part in np.split(numbers[3:], 4)
        )
        found[name] = {
            "judged": _judged(float(probability), sigmas),
            "probability_worse": None if np.isnan(probability) else float(probability),
            "surprise_sigmas": sigmas,
            "directions": int(freedom),
            "position_m": shift,
            "position_deviation_m": shift_deviations,
            "rotation_rad": turn,
            "rotation_deviation_rad": turn_deviations,
        }
    return found


def _judged(probability: float, sigmas: float | None) -> str:
    if np.isfinite(probability):
        if probability >= SURE:
            return WORSE
        return AS_TOLD if probability <= 1.0 - SURE else OPEN
    if sigmas is None:
        return UNKNOWN
    return DOES_NOT_FIT if sigmas > UNLIKELY_SIGMAS else AS_TOLD


def calibration_facts(found: dict[str, dict[str, Any]] | None) -> list[tuple[str, str]]:
    """Label and words for the table at the end of a run, of `found_calibrations`."""
    facts = []
    for name, one in (found or {}).items():
        words = one["judged"]
        if one["probability_worse"] is not None:
            words += f" ({one['probability_worse']:.1%} worse)"
        elif one["surprise_sigmas"] is not None:
            words += f" ({one['surprise_sigmas']:.1f} sigma)"
        facts.append(
            (
                f"camera {NAMES[name]}",
                f"{words}; off by {1e3 * one['position_m']:.1f} +- "
                f"{1e3 * one['position_deviation_m']:.1f} mm, "
                f"{np.degrees(one['rotation_rad']):.2f} +- "
                f"{np.degrees(one['rotation_deviation_rad']):.2f} deg",
            )
        )
    return facts
