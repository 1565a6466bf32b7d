"""Workspaces: grids of poses, what holds at each, volume and surface of where it holds.

`regions` has grids, volumes and surfaces; `wrenches` what cables can hold, resist and accelerate;
`conditions` stiffness, vibrations and dexterity; `interference` what cables and platform meet;
`certificate` proofs for whole boxes of poses.
Functions take arrays of poses and any number of rows that the platform can move.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2 and 1.3.3.

Proofs that every pose of a box belongs to a workspace, or that none does.

A box is a pose (position, angles of R = Rx Ry Rz) and half widths h_k of each of its six numbers;
delta stands for the deviation from the pose, |delta_k| <= h_k. Exit and anchor points may be off by
r_A and r_B in any direction, each by itself. Cables run straight from their exit points, or over
pulleys at the frame, at the platform, or both, whose radii and axes are taken as they are.

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

**Pulleys at the frame.** A cable leaves its pulley at the tangent point A' = A + T(x), x = B - A,
and all of the above holds with v = B - A' = x - T(x), since the free part is a line through B. Of
the plane of the pulley let e point to B, n be the axis, u the free part's direction, m the normal
of u in the plane at A', y = n x e; L the free length, rho B's distance from the axis, o that of A'.
A turn of u in the plane by a / L and of the plane by b / rho, a = m.dx, b = y.dx, move A' by

  dT = -(r / L) u a + (o / rho) y b,   so   dv = N dx,   N = 1 + (r / L) u m' - (o / rho) y y',

and with f = u.dx, cos and sin those of `geometry.pulley_kernel`, once more differentiated,

  d2T = -m (r a^2 / L^2 + o cos b^2 / rho^2)
      + u (2 r f a / L^2 + r^2 a^2 / L^3 - r cos b^2 / (rho L) - o sin b^2 / rho^2)
      - y (2 r sin a b / (rho L) + 2 o (e.dx) b / rho^2),

of which, for |dx| = 1 and o <= 2 r, `pulleys_kernel._bend` bounds the components. So v^k is N
times that of the point B, D_v and the rest of x are multiplied by |N|, and half the bound on d2T
times the square of a bound on |x - x_0| is added to E_v. L and rho are bounded from below within
the box, as both are by convex functions. T is never longer than 2 r: where that is better, or the
cable might not run, A is taken for A', which is off by 2 r + r_A; then a box may be outside, as is
every pose at which a cable cannot run, but not inside.

**Pulleys at the platform** are the same in P: B' = B + S(R'(A' - p) - B). Both ends together solve
A' = A + T(B' - A) and that. By the above |dT| <= a |dx| with a = max(r / L, 2 r / rho), and c
likewise of S. With M_A and M_B, by how much a point of W at A' moves in P, and a point of P at B'
in W, a box in which a c < 1 has one solution for each pose, and between two poses

  |A' moved| <= ((1 + a) r_A + a (M_B + (1 + c) r_B + c M_A)) / (1 - a c),
  |B' moved in P| <= (1 + c) r_B + c (|A' moved| + M_A).

These stand for r_A and r_B about the tangent points at the middle, the ends of the free part. That
at the middle is found by alternation; what a last round still moves it, over 1 - a c, is added.
Proofs of interference take the same bounds for pulleys at the frame.

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
positive tensions are shown to balance nothing; those from `CLOSURE_SHARE` to 1 serve to find some.

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
of the n - 1 cables that it is normal to are sure, and c_k turns it with them. For closure c_0 is
the centre of the cone {c: W'c < 0}, c_k keeps products with it as they are, and f_i < 0 is shown:
no positive tensions balance anything.

**Interference.** n(delta) = n_0 + sum delta_k n_k, k over the position, separates two things if
n(delta) times any point of one less any point of the other exceeds (the distance that is asked for,
and what points are off by, turns too: s |b|) times a bound on |n(delta)|. For two cables the
difference of points is linear in the place on each, so four corners decide: exit or anchor point of
one less that of the other, a fixed vector Q plus sign delta, sign 0, 1 or -1. For a cable and a
box, seen from the box, one end of the cable rests and the other is moved by sign delta: of the
cable two ends decide, of the box the corner where n(delta) points, or, where a component of n may
change its sign, both corners. Then n(delta).(Q + sign delta) is

  n_0.Q + sum delta_k (n_k.Q + sign n_0k) + sign sum delta_j delta_k n_kj,

bounded term by term. Where a length f next to the resting end is left out, the part begins at that
end + f u(delta); u, the direction of the cable q of length l, is off its first order by at most
|d|^2 (1 / l^2 + (l + |d|) / (l - |d|)^3), |d| what ends move against each other. Nothing else than
n_0, n_k is chosen: from the nearest points at the middle, so that n stays normal to cables and
edges.

A box is outside if some point of a cable and some point of what it meets, at shares of their
lengths that may follow delta, are too near for all delta: their distance is at most that at the
middle, plus sum h_k |w_k| with w_k = (x - y) e_k + x_k D - y_k D' the rates at which it changes,
plus |h| sum h_k |x_k - y_k|, for cables along D and D', nearest at x and y. Of a box the point need
only stay within, axis by axis.

**Rounding.** All that enters a proof is computed from coordinates by at most a few dozen additions
and products, each wrong by 1.1e-16 of its result. `ROUNDING` times the sum of the absolute values
of everything that is added is put on every bound; it is more than a thousand times that of a sum of
so many terms. The numbers that a proof is made with (tau, P, c) may be anything and need no bound.

Source: Krawczyk's and Neumann's arguments as in Rump, Verification methods, Acta Numerica 2010; for
workspaces with intervals: Gouttefarde, Daney and Merlet, Interval-analysis-based determination of
the wrench-feasible workspace of parallel cable-driven robots, 2011.

What else makes a pose good: stiffness, vibrations, dexterity, an even share of the load.

The platform is held by the tensions of least 2-norm where a number depends on them. Turns and
moments are compared with translations and forces by `StaticCase.arm`.

Source: servoing thesis 1.2.4; Gazebo thesis 2.5; Pham et al., 2009.

What cables and platform meet: distances between straight cables and boxes, exact.

The platform, the beams of the frame and obstacles are boxes; a cable is a segment with a radius.
Next to its ends a cable touches what carries it, so a length there is left out by name.

Source: Perreault et al., 2010; Ericson, Real-Time Collision Detection, 2005.

Grids of poses over a box; volume and surface of the part where something holds.

A grid is a box of positions times a list of orientations. Volumes come by three rules, named in
every result.

Source: servoing thesis 1.3.3.

Which wrenches cables can give at a pose, and whether these are the ones that are asked for.

At a pose the tensions lower <= t <= upper give the wrenches W t, a zonotope. A pose is feasible
where all wrenches that are demanded of the cables, `demands`, lie in it: to bear the weight
(static), to resist a set of wrenches too (wrench-feasible), or to accelerate the platform
(dynamic). Where tensions without upper limits give every wrench, the pose has wrench closure.

Rows of W are those that the platform can move, six or fewer; moments are divided by a length,
`StaticCase.arm`, where they are compared with forces.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2, (1.25); Bosscher, Riechel and Ebert-Uphoff,
Wrench-feasible workspace generation for cable-driven robots, 2006.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
