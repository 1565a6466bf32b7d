"""What the study runs: sources, and what is wrong with them."""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_drake.analyses.studies.fusion.trials import FusionTrial

SEEDS, QUICK_SEEDS = 10, 1

DURATION, QUICK_DURATION = 12.0, 1.0
"""Time of a run [s]; the servo arrives after about 8."""

SPAN = "start: 2.0, duration: 3.0"
"""When a camera fails: under way, while the platform is fastest."""

_FUSION = "estimator.sensor_fusion"
ON_BOARD = (f"{_FUSION}.external=false",)
EXTERNAL = (f"{_FUSION}.on_board=false",)
IMU = (f"{_FUSION}.imu=true", "sensors.imu={type: adis16448}")
DEPTH = (f"{_FUSION}.external_depth=kinect",)
NO_GATES = (f"{_FUSION}.gate=0",)
ON_BOARD_WRONG = ("perturbations.camera_pose_shift={distance: 0.02, angle_deg: 1.0}",)
EXTERNAL_WRONG = ("perturbations.external_camera_shift={distance: 0.02, angle_deg: 1.0}",)
DOUBTED = (f"{_FUSION}.on_board_doubt={{}}", f"{_FUSION}.external_doubt={{}}")
"""Either camera may be worse than told, with the probability and the sizes that are default."""

_TOLD = "{probability: 0.5, position: 0.012, rotation_deg: 0.6}"
ON_BOARD_TOLD = (f"{_FUSION}.on_board_doubt={_TOLD}",)
EXTERNAL_TOLD = (f"{_FUSION}.external_doubt={_TOLD}",)
"""One camera may be wrong by what it is then wrong by, 2 cm and 1 deg in any direction."""

KNOCKED = (
    "estimator.platform_tag.fault={kind: off, start: 3.0, duration: 1000.0, "
    "offset: [0.012, -0.012, 0.0106], angles_deg: [0.6, -0.6, 0.53]}",
)
"""2 cm and 1 deg from 3 s on."""


def _fault(camera: str, kind: str) -> tuple[str, ...]:
    """A fault of a kind in the span."""
    return (f"{camera}.fault={{kind: {kind}, {SPAN}}}",)


_SERVO, _WORLD = "camera", "estimator.platform_tag"


@dataclass(frozen=True)
class Configuration:
    """A configuration of the study.

    Attributes:
        name: Key in the results.
        words: For tables.
        changes: Items "key=value" of the scenario.
    """

    name: str
    words: str
    changes: tuple[str, ...]

    def trial(self, quick: bool) -> FusionTrial:
        """What is run of it."""
        return FusionTrial(self.changes, QUICK_DURATION if quick else DURATION)


ALL = (
    Configuration("on_board", "camera on board", ON_BOARD),
    Configuration("external", "camera in the world", EXTERNAL),
    Configuration("both", "both", ()),
    Configuration(
        "on_board covered", "on board, covered for 3 s", (*ON_BOARD, *_fault(_SERVO, "dead"))
    ),
    Configuration(
        "external covered", "in the world, covered for 3 s", (*EXTERNAL, *_fault(_WORLD, "dead"))
    ),
    Configuration("both, on_board covered", "both, on board covered", _fault(_SERVO, "dead")),
    Configuration("both, external covered", "both, in the world covered", _fault(_WORLD, "dead")),
    Configuration("both, on_board frozen", "both, on board frozen", _fault(_SERVO, "frozen")),
    Configuration("both, external off", "both, in the world off by 3 cm", _fault(_WORLD, "off")),
    Configuration("on_board wrong", "on board, 2 cm and 1 deg wrong", (*ON_BOARD, *ON_BOARD_WRONG)),
    Configuration(
        "external wrong", "in the world, 2 cm and 1 deg wrong", (*EXTERNAL, *EXTERNAL_WRONG)
    ),
    Configuration("both, on_board wrong", "both, on board wrong", ON_BOARD_WRONG),
    Configuration("both, external wrong", "both, in the world wrong", EXTERNAL_WRONG),
    Configuration(
        "both, external wrong, no gates", "the same, nothing left out", (*EXTERNAL_WRONG, *NO_GATES)
    ),
    Configuration("both, external knocked", "both, in the world knocked after 3 s", KNOCKED),
    Configuration("both, doubted", "both, doubted", DOUBTED),
    Configuration(
        "both, on_board wrong, told",
        "both, on board wrong, as told",
        (*ON_BOARD_WRONG, *ON_BOARD_TOLD),
    ),
    Configuration(
        "both, external wrong, told",
        "both, in the world wrong, as told",
        (*EXTERNAL_WRONG, *EXTERNAL_TOLD),
    ),
    Configuration(
        "both, external wrong, doubted",
        "both, in the world wrong, both doubted",
        (*EXTERNAL_WRONG, *DOUBTED),
    ),
    Configuration(
        "both, external wrong, told, on_board covered",
        "both, in the world wrong, as told, on board covered",
        (*EXTERNAL_WRONG, *EXTERNAL_TOLD, "camera.fault={kind: dead, start: 2.0, duration: 1000}"),
    ),
    Configuration(
        "both, external knocked, doubted",
        "both, in the world knocked, both doubted",
        (*KNOCKED, *DOUBTED),
    ),
    Configuration("both, imu", "both and an IMU", IMU),
    Configuration("both, depth", "both and depths", DEPTH),
    Configuration("external, imu", "in the world and an IMU", (*EXTERNAL, *IMU)),
    Configuration("external, depth", "in the world and depths", (*EXTERNAL, *DEPTH)),
    Configuration("all", "both, an IMU and depths", (*IMU, *DEPTH)),
)
"""All of them; encoders and tension sensors are read by each."""

QUICK = ("on_board", "external", "both")
"""Those of the quick form."""


def configurations(quick: bool) -> list[Configuration]:
    """All of them, or the few of the quick form."""
    return [c for c in ALL if not quick or c.name in QUICK]
