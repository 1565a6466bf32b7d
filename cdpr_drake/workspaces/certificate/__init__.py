"""Proofs that every pose of a box belongs to a workspace, or that none does.

A box is a pose (position, angles of R = Rx Ry Rz) and half widths h_k of each of its six numbers;
delta stands for the deviation from the pose, |delta_k| <= h_k. Exit and anchor points may be off by
r_A and r_B in any direction, each by itself. Cables run straight from their exit points.

**Expansion.** Cable i has the anchor's arm b_i in W, the vector v_i = p + b_i - a_i of length l_i,
u_i = v_i / l_i, and the scaled column g_i = -(b_i x v_i, v_i), so that W t = V tau with tau = t /
l: V is a polynomial where W is not. With s the sum of the half widths of the angles,

  b_i(delta) = b_i + sum_k delta_k b_i^k + e_b,  |e_b| <= E_b = s^2 |b_i| / 2 + r_B
  v_i(delta) = v_i + sum_k delta_k v_i^k + e_v,  |e_v| <= E_v = s^2 |b_i| / 2 + r_A + r_B

since every second derivative of R b by angles is at most |b|. With x = sum delta_k v^k, |x| <= D_v,
and |sum delta_k b^k| <= D_b, the forces of g_i are off their first order by at most E_v, the
moments by D_b D_v + E_b (|v| + D_v) + (|b| + D_b) E_v + E_b E_v; without turns and errors by
nothing. The length is l + u.x + lambda with -E_v <= lambda <= D_v^2 / (2 (l - D_v)) + E_v, for l >
D_v. What is demanded, V tau = d, is expanded likewise: the weight's arm turns.

**Inside.** Take any tau_0, tau_k and any P, and let tau^ = tau_0 + sum delta_k tau_k. The residual
rho = d - V tau^ is at most rho_bar in each row: its order 0, |delta_k| times its order 1, the
products delta_j delta_k of V^j tau_k (of each pair j, k both together), the remainders above times
|tau^|, and rounding. If no row of a bound on |1 - V P|, which is |1 - V_0 P| + sum h_k |V^k P| +
the remainders times |P|, sums to more than kappa < 1, V P is regular, and tau = tau^ + P (V P)^-1
rho solves V tau = d exactly. It differs from tau^ by at most |P| (rho_bar + kappa / (1 - kappa) max
rho_bar) =: |P| y. So t_i = l_i tau_i differs from l_i tau_0i by at most

  sum_k h_k |l tau_k + tau_0 u.v^k| + (sum h_k |u.v^k|) (sum h_k |tau_k|)
    + |lambda| |tau^| + (l + D_v + E_v) (|P| y),

and where that leaves all tensions within their bounds, every pose of the box is feasible, and W is
regular there. For a polytope of wrenches the proof is made for each vertex: what is demanded may be
any of their means, and the mean of tensions within bounds is within bounds. For wrench closure
tensions from `CLOSURE_SHARE` to 1 are shown to balance nothing.

How tau_0, tau_k and P are found has no part in the proof. t_0 is the analytic centre of the
feasible tensions; with D the tensions' distances from their bounds there as the barrier has them,
P = D^2 W' (W D^2 W')^-1 moves tensions by as much as they have room, and the first order vanishes.

**Outside.** Take any c(delta) = c_0 + sum delta_k c_k. If c.d > sum_i max(lower q_i, upper q_i) for
all delta, q_i = c.g_i / l_i, no tensions within the bounds give d. f_i = c.g_i is expanded as g_i
above; q = q_0 + sum delta_k q^k + R_q with q^k = (f^k - q_0 u.v^k) / l and

  |R_q| <= (R_f + |sum delta_k q^k| |u.x| + (|q_0| + |sum delta_k q^k|) |lambda|) / (l - D_v - E_v).

Where a bound shows the sign of q_i, its tension is known, and its first order is added to that of
c.d before absolute values are taken; otherwise it counts with the largest value it could have. c_0
is the normal of the facet beyond which the wrench lies farthest, tilted by so little that the signs
of the n - 1 cables that it is normal to are sure, and c_k turns it with them. For closure c is
constant, in the cone {c: W'c <= 0}, and f_i < 0 is shown: no positive tensions balance anything.

**Interference.** A point of a cable moves by at most as much as its anchor point. Between two
positions cables shift by the same vector, each point by a share of it, so no distance of two
cables, or of one and something fixed or the platform, changes by more than the shift |h|; with
angles, points of the platform shift by at most s |b| more, with errors by r_A + r_B more, each of
two partners. A box is inside if the least clearance at its pose exceeds what is asked for by more
than that, outside if it falls short by more.

**Rounding.** All that enters a proof is computed from coordinates by at most a few dozen additions
and products, each wrong by 1.1e-16 of its result. `ROUNDING` times the sum of the absolute values
of everything that is added is put on every bound; it is more than a thousand times that of a sum of
so many terms. The numbers that a proof is made with (tau, P, c) may be anything and need no bound.

Source: Krawczyk's and Neumann's arguments as in Rump, Verification methods, Acta Numerica 2010; for
workspaces with intervals: Gouttefarde, Daney and Merlet, Interval-analysis-based determination of
the wrench-feasible workspace of parallel cable-driven robots, 2011.
"""

from cdpr_drake.workspaces.certificate.boxes import (
    CertifiedBoxes,
    CertifiedKind,
    CertifyTask,
    PoseBox,
    certify,
)
from cdpr_drake.workspaces.certificate.expansion_kernel import INSIDE, OPEN, OUTSIDE

__all__ = [
    "INSIDE", "OPEN", "OUTSIDE", "CertifiedBoxes", "CertifiedKind", "CertifyTask", "PoseBox",
    "certify",
]  # fmt: skip
