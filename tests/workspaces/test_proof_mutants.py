"""The proof needs its terms: without one of these it proves what is not so."""

import numpy as np
import pytest

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import rotation_from_angles
from cdpr_drake.tensions.quadratic_program_kernel import workspace_shape
from cdpr_drake.workspaces import (
    box_expansion_kernel as expansion_kernel,
)
from cdpr_drake.workspaces import (
    box_inside_kernel as inside_kernel,
)
from cdpr_drake.workspaces import (
    box_outside_kernel as outside_kernel,
)
from cdpr_drake.workspaces.box_judges import CLOSURE_SHARE
from cdpr_drake.workspaces.static_feasibility import StaticCase
from cdpr_drake.workspaces.wrench_capacity import capacity_margins, closure_margins
from tests.mutants import as_python
from tests.workspaces.workspace_cases import robot_case

SCALES = np.geomspace(2.0, 0.005, 28)
"""Sizes of boxes that are tried, the largest first."""

TRIES = 14
"""Poses of each trial."""


class Trial:
    """A planar robot, and how boxes of it are judged."""

    def __init__(self, inside, outside, errors, closure):
        self.functions = as_python(expansion_kernel)
        self.errors, self.closure = np.array(errors), closure
        _, case = robot_case("planar", (1.0, 12.0))
        self.case = StaticCase(
            case.cables, case.lower, case.upper, case.weight, case.p_PCo,
            wrench=np.array([0, 0, 0.1, 2.0, 1.0, 0]), rows=case.rows,
        )  # fmt: skip
        self.inside, self.outside = inside, outside

    def proven(self, pose, half, expand):
        """1, 0 or -1."""
        case, n, m = self.case, 3, 4
        points = np.vstack([case.cables.p_WA, case.cables.p_PB]).T
        g, gk = np.empty((n, m)), np.empty((6, n, m))
        lengths, rest = np.empty((7, m)), np.empty((3 + n, m))
        scale, rows = case.row_scale(), np.array(case.rows)
        off, turns = np.tile([*self.errors, 0.0, 1.0], (m, 1)), np.empty((m, 3, 3))
        if not expand(pose, half, points, rows, scale, off, turns, g, gk, lengths, rest):
            return 0
        d, d_rest = np.zeros((7, n)), np.zeros(n)
        lower, upper = case.lower, case.upper
        if self.closure:
            lower, upper = np.full(m, CLOSURE_SHARE), np.ones(m)
        else:
            d[0] = -case.wrench[rows] / scale
        work = np.empty(workspace_shape(n, m))
        rests = (half, g, gk, lengths, rest, d, d_rest, lower, upper)
        if self.inside["proves_inside"](*rests, self.closure, np.zeros(6), work, np.empty(6)):
            return 1
        W = g / lengths[0]
        normals = np.array([np.cross(W[:, i], W[:, j]) for i in range(4) for j in range(i)])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.concatenate([normals, -normals])
        q = normals @ W
        if self.closure:
            cone = normals[np.all(q <= 1e-9, axis=1)]
            if not len(cone):
                return 0
            c, ck = cone.sum(0), np.empty((6, n))
            self.outside["central_direction"](W, c)
            self.outside["follow_cone"](c, half, W, gk, lengths, ck)
            return -int(self.outside["proves_open_cone"](c, ck, half, g, gk, rest, np.empty(6)))
        room = np.maximum(q * lower, q * upper).sum(1) - normals @ d[0]
        worst = int(np.argmin(room))
        if room[worst] >= 0.0:
            return 0
        c = normals[worst].copy()
        return -int(self.outside["proves_outside"](c, *rests, np.empty(6)))

    def broken(self, expand, seed=0):
        """Whether a box that was proven has a pose, with points that are off, where it is not so.

        At each pose the largest box is looked at that the proof accepts.
        """
        random = np.random.default_rng(seed)
        signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
        for _ in range(TRIES):
            pose = np.zeros(6)
            pose[:2], pose[2] = random.uniform(-0.45, 0.45, 2), 0.3
            pose[5] = random.uniform(-0.5, 0.5)
            shape = np.array([0.2, 0.2, 0, 0, 0, 0.5]) * random.choice([0.05, 0.3, 1.0], 6)
            for scale in SCALES:
                verdict = self.proven(pose, scale * shape, expand)
                if verdict:
                    break
            else:
                continue
            moves = np.zeros((40, 6))
            moves[:8, [0, 1, 5]] = signs
            moves[8:, [0, 1, 5]] = random.uniform(-1, 1, (32, 3))
            poses = pose + moves * scale * shape
            turns = np.array([rotation_from_angles(a).matrix() for a in poses[:, 3:]])
            for _ in range(12 if self.errors.any() else 1):
                shifts = random.normal(size=(2, 3, 4))
                shifts[:, 2] = 0.0
                shifts *= self.errors[:, None, None] / np.linalg.norm(shifts, axis=1)[:, None]
                cables = self.case.cables
                cables = CableSet.make(cables.p_WA + shifts[0], cables.p_PB + shifts[1], 1.0)
                case = StaticCase(
                    cables, self.case.lower, self.case.upper, self.case.weight, self.case.p_PCo,
                    wrench=self.case.wrench, rows=self.case.rows,
                )  # fmt: skip
                if self.closure:
                    truth = closure_margins(case, poses[:, :3], turns) > 0.0
                else:
                    truth = capacity_margins(case, poses[:, :3], turns).margins > 0.0
                if np.any(truth != (verdict > 0)):
                    return True
        return False


SETTINGS = [((0.0, 0.0), False), ((0.02, 0.0), False), ((0.0, 0.01), False), ((0.0, 0.0), True)]
SETTINGS += [((0.02, 0.0), True)]


@pytest.mark.parametrize(("errors", "closure"), SETTINGS)
def test_the_proof_itself_is_not_broken(errors, closure):
    trial = Trial(as_python(inside_kernel), as_python(outside_kernel), errors, closure)
    assert not trial.broken(expansion_kernel.expand)


MUTANTS = [
    (inside_kernel, "off = first + along", "off = along"),
    (inside_kernel, "lower[i] + off <= middle", "lower[i] <= middle"),
    (inside_kernel, "bound += rest[3 + k, i] * largest[i]", "bound += 0.0"),
    (inside_kernel, "first += half[j] * abs(", "first += half[j] * ("),
    (inside_kernel, "(rho[k] + more)", "0.0"),
    (expansion_kernel, "_cross(b, vk, y)", "_cross(vk, b, y)"),
    (expansion_kernel, "+ off[i, EXIT] + off[i, ANCHOR]", "+ off[i, ANCHOR]"),
    (expansion_kernel, "E_b = 0.5 * s * s * arm + off[i, ANCHOR]", "E_b = 0.5 * s * s * arm"),
    (outside_kernel, "loss += half[j] * abs(rate[j])", "loss += 0.0"),
    (outside_kernel, "loss += max(upper[i] * highest, lower[i] * highest)", "loss += 0.0"),
    (outside_kernel, "if abs(q) > width[i]:", "if True:"),
    (outside_kernel, "f += part[k] * rest[3 + k, i]", "f += 0.0"),
    (outside_kernel, "f += half[j] * half[o] * abs(value)", "f += 0.0"),
]


@pytest.mark.parametrize(("module", "old", "new"), MUTANTS)
def test_mutants_of_the_proof_are_found(module, old, new):
    modules = {m: as_python(m) for m in (inside_kernel, outside_kernel, expansion_kernel)}
    modules[module] = as_python(module, (old, new))
    for errors, closure in SETTINGS:
        trial = Trial(modules[inside_kernel], modules[outside_kernel], errors, closure)
        for seed in (0, 1):
            if trial.broken(modules[expansion_kernel]["expand"], seed):
                return
    pytest.fail("nobody noticed")
