"""What the study runs: sources, and what is wrong with them; ways to take up slack."""

from __future__ import annotations

from collections.abc import Iterator

from cdpr_drake.analyses.studies.framework.study import Case, Form
from cdpr_drake.analyses.studies.fusion.slack_trials import SURPLUSES, WAYS

SERVO, SLACK = "servo", "slack"
"""What is run: a servo on the fused pose, a start with slack cables."""

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


CONFIGURATIONS: dict[str, tuple[str, tuple[str, ...]]] = {
    "on_board": ("camera on board", ON_BOARD),
    "external": ("camera in the world", EXTERNAL),
    "both": ("both", ()),
    "on_board covered": ("on board, covered for 3 s", (*ON_BOARD, *_fault(_SERVO, "dead"))),
    "external covered": ("in the world, covered for 3 s", (*EXTERNAL, *_fault(_WORLD, "dead"))),
    "both, on_board covered": ("both, on board covered", _fault(_SERVO, "dead")),
    "both, external covered": ("both, in the world covered", _fault(_WORLD, "dead")),
    "both, on_board frozen": ("both, on board frozen", _fault(_SERVO, "frozen")),
    "both, external off": ("both, in the world off by 3 cm", _fault(_WORLD, "off")),
    "on_board wrong": ("on board, 2 cm and 1 deg wrong", (*ON_BOARD, *ON_BOARD_WRONG)),
    "external wrong": ("in the world, 2 cm and 1 deg wrong", (*EXTERNAL, *EXTERNAL_WRONG)),
    "both, on_board wrong": ("both, on board wrong", ON_BOARD_WRONG),
    "both, external wrong": ("both, in the world wrong", EXTERNAL_WRONG),
    "both, external wrong, no gates": (
        "the same, nothing left out", (*EXTERNAL_WRONG, *NO_GATES),
    ),
    "both, external knocked": ("both, in the world knocked after 3 s", KNOCKED),
    "both, doubted": ("both, doubted", DOUBTED),
    "both, on_board wrong, told": (
        "both, on board wrong, as told", (*ON_BOARD_WRONG, *ON_BOARD_TOLD),
    ),
    "both, external wrong, told": (
        "both, in the world wrong, as told", (*EXTERNAL_WRONG, *EXTERNAL_TOLD),
    ),
    "both, external wrong, doubted": (
        "both, in the world wrong, both doubted", (*EXTERNAL_WRONG, *DOUBTED),
    ),
    "both, external wrong, told, on_board covered": (
        "both, in the world wrong, as told, on board covered",
        (*EXTERNAL_WRONG, *EXTERNAL_TOLD, "camera.fault={kind: dead, start: 2.0, duration: 1000}"),
    ),
    "both, external knocked, doubted": (
        "both, in the world knocked, both doubted", (*KNOCKED, *DOUBTED),
    ),
    "both, imu": ("both and an IMU", IMU),
    "both, depth": ("both and depths", DEPTH),
    "external, imu": ("in the world and an IMU", (*EXTERNAL, *IMU)),
    "external, depth": ("in the world and depths", (*EXTERNAL, *DEPTH)),
    "all": ("both, an IMU and depths", (*IMU, *DEPTH)),
}  # fmt: skip
"""Words and changes of the scenario by name; encoders and tension sensors are read by each."""

QUICK = ("on_board", "external", "both")
"""Those of the quick form."""


def cases(form: Form) -> Iterator[Case]:
    """All of them, or the few of the quick form, which end under way, and a start with slack."""
    for name in QUICK if form.quick else CONFIGURATIONS:
        words, changes = CONFIGURATIONS[name]
        duration = QUICK_DURATION if form.quick else DURATION
        yield Case(
            name=name,
            keys={
                "trial": SERVO, "configuration": name, "sources": words, "duration_s": duration,
            },
            changes=changes,
        )  # fmt: skip
    for way in WAYS:
        for surplus in SURPLUSES:
            if not form.quick or (way, surplus) == ("image", SURPLUSES[0]):
                name = f"{way}, {100.0 * surplus:g} cm"
                yield Case(name=name, keys={"trial": SLACK, "way": way, "surplus_m": surplus})
