"""What the expansion of a cable misses is within the bound of certificates, and comes near."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdpr_drake.proofs.linear_forms_kernel import cable_remainder

# Cable by cable: in the whole criterion sums over cables hide terms of third order.

COUNT = 40_000  # random cables and perturbations for each question
TIGHT = {"n": 0.99, "z_w": 0.98}
"""Shares of the bound that the worst cables reach at least; found 0.9999 and 0.997. Of 25 terms
and factors of the bound, 19 let some cable pass it where they are dropped alone; the others,
products of F with |db| or of third order in F, lie below what is left elsewhere."""
LARGEST = {
    "F": 0.5, "G": 0.8, "r_bp": 0.3, "arm": 1.0, "size_A": 0.2, "size_B": 0.2, "seen": 0.5,
    "lever": 1.0,
}  # fmt: skip
"""Bounds of the perturbations and arms of a cable of 1 m are drawn up to these [rad, m]."""


def directions(random):
    """Unit vectors for the eight perturbations and arms of each cable, often in one plane."""
    V = random.normal(size=(COUNT, 8, 3))
    flat = random.random(COUNT) < 0.5
    V[flat, :, 2] = 0.0
    along = random.random((COUNT, 8)) < 0.3  # along or across the cable, which is x
    V[along & (random.random((COUNT, 8)) < 0.5)] *= [1.0, 1e-9, 1e-9]
    return V / np.linalg.norm(V, axis=2, keepdims=True)


def times(R, x):
    return np.einsum("nij,nj->ni", R, x)


def dot(x, y):
    return np.sum(x * y, axis=1, keepdims=True)


def remainders(random, which):
    """What the expansion misses per unit of n or of z_w, and its bound, each of shape (COUNT,).

    Many bounds of perturbations are zero, so that every term is large somewhere.
    """
    s = {
        name: largest * random.random(COUNT) ** 2 * (random.random(COUNT) < 0.5)
        for name, largest in LARGEST.items()
    }
    V = directions(random)
    radii = np.stack([s[k] for k in ("F", "G", "r_bp", "size_A", "size_B", "arm", "lever")], axis=1)
    f, g, dp, da, db, b, c = np.moveaxis(radii[:, :, None] * V[:, :7], 1, 0)
    share = random.random((COUNT, 1))
    other = Rotation.random(COUNT, random_state=1).apply(V[:, 7])
    dt, ds = share * s["seen"][:, None] * V[:, 7], (1.0 - share) * s["seen"][:, None] * other
    u = np.broadcast_to([1.0, 0.0, 0.0], (COUNT, 3))
    cross = np.cross
    turn_f, turn_g = Rotation.from_rotvec(f).as_matrix(), Rotation.from_rotvec(g).as_matrix()

    def across(x):
        return x - u * dot(u, x)

    q = u + dp - da + times(turn_f, b + db) - b  # length 1, so P / l is `across`
    U = times(np.swapaxes(turn_f, 1, 2), q / np.linalg.norm(q, axis=1, keepdims=True))
    shift = dp + cross(f, b)
    U1 = across(shift) - cross(f, u)
    curved = -dot(u, shift) * across(shift) - 0.5 * dot(across(shift), across(shift)) * u
    U2 = curved + 0.5 * across(cross(f, cross(f, b))) - cross(f, across(shift))
    U2 = U2 + 0.5 * cross(f, cross(f, u))

    def missed(n, zw):
        zv = n - cross(zw, c)
        N = times(turn_g, zv + cross(ds, zw)) + cross(times(turn_g, zw), c + db - dt)
        n_g = cross(g, zv) + cross(cross(g, zw), c)
        seen = cross(ds + dt, zw)
        later = times(turn_g, zv) - zv + cross(times(turn_g, zw) - zw, c) - n_g
        swung = times(turn_g, cross(ds, zw)) - cross(ds, zw) - cross(times(turn_g, zw) - zw, dt)
        known = dot(u, n + n_g + seen + cross(zw, db) + later + swung)
        known = known + dot(U1 + across(db - da) + U2, n) + dot(U1, n_g + seen)
        return (dot(U, N) - known)[:, 0]

    nothing = np.zeros((COUNT, 3))
    basis = [np.broadcast_to(e, (COUNT, 3)) for e in np.eye(3)]
    parts = [missed(e, nothing) if which == "n" else missed(nothing, e) for e in basis]
    known, lone = s["r_bp"] + s["F"] * s["arm"], s["size_A"] + s["size_B"]
    bounds = np.full(COUNT, np.inf)
    for k in np.flatnonzero(known + lone < 0.9):
        bounds[k] = cable_remainder(
            known[k], s["arm"][k], s["lever"][k], 1.0, s["F"][k], s["G"][k], s["seen"][k], lone[k],
            s["size_B"][k],
        )[0 if which == "n" else 1]  # fmt: skip
    return np.linalg.norm(parts, axis=0), bounds


@pytest.mark.parametrize("which", ["n", "z_w"])
def test_no_cable_moves_beyond_the_remainder_and_some_as_far(which):
    missed, bounds = remainders(np.random.default_rng(3), which)
    assert np.all(missed <= bounds + 1e-12)  # sums of numbers up to 10 in double precision
    large = np.isfinite(bounds) & (bounds > 1e-6)
    assert np.max(missed[large] / bounds[large]) > TIGHT[which]
