"""All constants of a robot in motion as arrays for the kernels of `dynamics`, and work space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import behaviour_of
from cdpr_drake.cables.hanging_kernel import SENSITIVITIES
from cdpr_drake.cables.models import cable_law, check_model
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.cables.simulation_kernel import make_room
from cdpr_drake.dynamics.contact_hysteresis import ContactHysteresis
from cdpr_drake.dynamics.contact_kernel import CONTACTS, pack_contacts
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import CABLE_COLUMNS
from cdpr_drake.geometry.platform_joint import PlatformJoint
from cdpr_drake.statics.rigid_platform import RigidPlatform
from cdpr_drake.winches.groups import WinchGroups
from cdpr_drake.winches.motor import MODES, TORQUE, WinchLaw
from cdpr_drake.winches.motor_kernel import pack_winch

IDEAL, MOTORS, TENSIONS = range(3)
"""What drives the cables: winches that follow velocities at once, motors, or tensions as such."""

DRIVE, MODE, LAW, PUSH, PLATFORM, SPEEDS, WINCH, CREEPING, RUBBING = range(9)
"""Entries of `RobotArrays.kinds`: drive, mode of the motors, law of the cables, whether a negative
tension pushes, states of the platform, its velocities, states of the winches, and behind those at
the end of the state what has crept of the cables: their number, or 0; before that how far contacts
are bent that rub as the platform turns: the number of its turns, or 0."""

COM, GRAVITY, DAMPING, INERTIA, INVERSE, APPLIED, RUB = 1, 4, 7, 9, 18, 54, 61
"""Where in `RobotArrays.body` begin: centre of mass (3), gravity (3), damping (2), rotational
inertia (9), inverse of the mass matrix in P (36, or 9 of a planar platform), what else acts on the
platform: 1 where something does, and its generalized force (6, or less), see `apply_wrench`; and
the law of contacts, see `contact_kernel.pack_contacts`."""

BODY_SIZE = RUB + CONTACTS

COLUMNS = 10
"""Row of `RobotArrays.vectors` from which on the cables stand by columns, one row for each."""

STAGES = 8
"""Rows of `RobotArrays.work`, each as long as the state."""


class RobotArrays(NamedTuple):
    """What the kernels take of a robot; made by `pack_robot`.

    Attributes:
        kinds: See `DRIVE`, shape (9,), whole numbers.
        body: Mass [kg], then as `COM` says, in SI units, shape (`BODY_SIZE`,).
        cables: `CableSet.packed()` in the joint's frames, shape (m, 17).
        home: Unstrained lengths where the motors' angles are zero, shape (m,) [m].
        winch: `pack_winch`; of ideal winches the rated cable speed [m/s] alone, shape (1, 1).
        room: `make_room` of the cables.
        force: Work space: generalized force, then tensions at the drums, shape (nv + m,).
        command: Work space: the command of a stage, shape (m,).
        work: Work space for stages, shape (8, n).
        guesses: Work space of catenaries, shape (m, 2) [N].
        inner: Work space, shape (6, 3).
        D: Work space, shape (8, 4).
        matrices: Work space of the semi-implicit step, shape (4, k, k), k velocities.
        vectors: Work space of the semi-implicit step, and from row `COLUMNS` on of straight cables,
            shape (18, max(k, m)).
    """

    kinds: Array
    body: Array
    cables: Array
    home: Array
    winch: Array
    room: Array
    force: Array
    command: Array
    work: Array
    guesses: Array
    inner: Array
    D: Array
    matrices: Array
    vectors: Array


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What drives the cables.

    Attributes:
        kind: `IDEAL`, `MOTORS` or `TENSIONS`.
        rated_speed: Largest cable speed of ideal winches [m/s].
        law: The motors.
        mode: Their mode, a name of `MODES`.
        push: Whether a commanded tension below zero pushes.
        groups: Which cables are on one winch; None: each is on a winch of its own.
    """

    kind: int = IDEAL
    rated_speed: float = np.inf
    law: WinchLaw | None = None
    mode: str = "velocity"
    push: bool = False
    groups: WinchGroups | None = None

    def winch_of_cable(self, m: int) -> list[int]:
        """Index of the command of each of m cables."""
        return list(range(m)) if self.groups is None else list(self.groups.of_cable)

    def states_per_cable(self) -> int:
        """Numbers per cable in the state: lengths, their rates, integrals of speed loops."""
        if self.kind == MOTORS:
            return 2 if MODES[self.mode] == TORQUE else 3
        return 1 if self.kind == IDEAL else 0


def pack_robot(
    platform: RigidPlatform,
    cables: CableSet,
    model: str,
    drive: Drive,
    *,
    home: Array,
    joint: PlatformJoint | None = None,
    damping: tuple[float, float] = (0.0, 0.0),
    contacts: ContactHysteresis | None = None,
) -> RobotArrays:
    """Packs a robot.

    Args:
        platform: The platform.
        cables: The cables as they are simulated.
        model: A name of `CABLE_MODELS`; not read where tensions are commanded.
        drive: What drives the cables.
        home: Unstrained lengths where the motors' angles are zero, shape (m,) [m].
        joint: What it moves by; None: that of its motion type, through the origin of W.
        damping: Force per velocity of Po [N s/m], moment per angular velocity [N m s/rad].
        contacts: Friction against turns of the platform; None: there is none.

    Raises:
        CableModelError: The model cannot describe the cables in the joint's frame.
    """
    m, law = cables.count, cable_law(model, cables)
    joint = joint or PlatformJoint.of(platform.motion)
    cables = joint.turned(cables)
    if drive.kind != TENSIONS:
        check_model(model, cables)
    states, speeds = joint.num_states, joint.num_velocities
    p_MCo, I_MMo = platform.p_PCo, np.asarray(platform.I_PPo, float)
    if not joint.is_as_world():
        R_PM = joint.R_PM.matrix()
        p_MCo, I_MMo = R_PM.T @ p_MCo, R_PM.T @ I_MMo @ R_PM
    winch = m * drive.states_per_cable()
    mode = MODES[drive.mode]
    creeping = 0
    if drive.kind != TENSIONS and behaviour_of(cables).creep_stiffness > 0.0:
        creeping = m
    rubbing, rubs = pack_contacts(contacts, joint)
    kinds = np.array(
        [drive.kind, mode, law, int(drive.push), states, speeds, winch, creeping, rubbing]
    )
    body = np.zeros(BODY_SIZE)
    body[0] = platform.mass
    body[COM : COM + 3] = p_MCo
    body[GRAVITY : GRAVITY + 3] = joint.in_frame(platform.acceleration())
    body[DAMPING : DAMPING + 2] = damping
    body[RUB : RUB + CONTACTS] = rubs
    body[INERTIA : INERTIA + 9] = I_MMo.ravel()
    inverse = np.linalg.inv(_mass_matrix(platform.mass, p_MCo, I_MMo, speeds)).ravel()
    body[INVERSE : INVERSE + len(inverse)] = inverse
    constants = np.array([[drive.rated_speed]])
    if drive.law is not None:
        constants = pack_winch(drive.law)
    k = speeds + (m if drive.kind == MOTORS else 0)
    return RobotArrays(
        kinds=kinds,
        body=body,
        cables=cables.packed(),
        home=np.ascontiguousarray(home, dtype=float),
        winch=constants,
        room=make_room(m, law, joint.height),
        force=np.zeros(speeds + m),
        command=np.zeros(m),
        work=np.zeros((STAGES, states + winch + rubbing + creeping)),
        guesses=np.zeros((m, 2)),
        inner=np.zeros((SENSITIVITIES, 3)),
        D=np.zeros((DERIVATIVES, 4)),
        matrices=np.zeros((4, k, k)),
        vectors=np.zeros((COLUMNS + CABLE_COLUMNS, max(k, m))),
    )


def apply_wrench(arrays: RobotArrays, joint: PlatformJoint, wrench: Array | None) -> None:
    """Has a wrench act on a packed platform from now on, beside cables and weight.

    Args:
        arrays: The robot; its `body` is changed.
        joint: What it was packed for.
        wrench: Moment about Po and force, in W, shape (6,) [N m, N]; None: none acts.
    """
    body = arrays.body
    body[APPLIED] = 0.0 if wrench is None else 1.0
    if wrench is not None:
        force = joint.wrench_map() @ wrench
        body[APPLIED + 1 : APPLIED + 1 + len(force)] = force


def _mass_matrix(m: float, com: Array, inertia: Array, speeds: int) -> Array:
    """About Po in P: shape (6, 6), (rotation, translation), planar (3, 3), (x, y, turn), or (1, 1).

    Args:
        m: Mass [kg].
        com: Centre of mass, shape (3,) [m].
        inertia: About Po, shape (3, 3) [kg m^2].
        speeds: Velocities: 6, 3 or 1.
    """
    cx, cy, cz = com
    if speeds == 1:
        return np.array([[m]])
    if speeds == 3:
        I = inertia[2, 2]  # noqa: E741
        return np.array([[m, 0.0, -m * cy], [0.0, m, m * cx], [-m * cy, m * cx, I]])
    M = np.zeros((6, 6))
    arm = m * np.array([[0.0, -cz, cy], [cz, 0.0, -cx], [-cy, cx, 0.0]])
    M[:3, :3] = inertia
    M[:3, 3:] = arm
    M[3:, :3] = -arm
    M[3:, 3:] = m * np.eye(3)
    return M
