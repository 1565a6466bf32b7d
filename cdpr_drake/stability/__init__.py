"""Where a visual servo converges although its model is wrong.

The closed loop is de/dt = -lambda Pi e with Pi = L J^+ J_hat L_hat^+ for features e, the true
robot without and the believed robot with a hat. The error falls where the symmetric part of Pi is
positive definite. `perturbations` bounds how wrong the model is, `criterion` computes Pi at a
pose, `certificate` bounds it from below over all perturbations, `verdicts` judges poses.

Source: servoing thesis chapter 3, with e in the lever of PBVS as its analysis has it, or the exact
matrix; see `LEVERS`.

A proof that no perturbation makes v' Pi v negative: quadratic forms that bound it from below.

Only perturbations of the estimate are covered, and of the object only its position under PBVS. The
proof is an expansion about one perturbation, the centre of a piece of `subdivision_kernel`, that
holds for the whole piece; with the nominal model as the centre the piece may be everything.

**Notation.** All vectors in the axes of the centre's camera frame C. v any vector of R^6,
x = K_l' v, z = K_r v, w = (J^+)' x with the nominal J; of the centre: J_c, X = J^+ J_c, y = X' x;
cable i has the vector q_i = l_i u_i from exit to anchor point, the anchor's arms b_i from P and c_i
from C, and n_i = z_v + z_w x c_i, so that (J_c z)_i = u_i . n_i. Perturbations away from the
centre: turns exp(f), exp(g) of platform and camera with |f| <= F, |g| <= G, shifts dp, dt, ds of
platform, camera and object, da_i, db_i of the points. A common shift of the exit points is one of
the platform; a common shift h of the anchor points is one of the platform by h and of the camera by
-h. Both are counted there, r_bp and r_pc being enlarged, and da_i, db_i stay for the others. Then,
exactly,

  v' Pi v = sum_i w_i U_i . N_i,   U = e^-f u^,   q^_i = q_i + dp - da_i + (e^f - 1) b_i + e^f db_i,
  N_i = e^g (z_v + ds x z_w) + (e^g z_w) x (c_i + db_i - dt).

A planar robot adds |v|^2 of the components that it cannot move to both sides.

**Order 0.** sum_i w_i u_i . n_i = v' Pi_c v, with Pi_c that of the centre; 1 for the nominal model.

**Order 1**, with P_i = 1 - u_i u_i', U1 = P (dp + f x b - da + db) / l - f x u, and
N1 = n_g + m, n_g = g x z_v + (g x z_w) x c, m = (ds + dt) x z_w + z_w x db:

  dp:   sum_i w_i (P_i dp / l_i) . n_i
  f:    sum_i w_i (P_i (f x b_i) / l_i - f x u_i) . n_i
  g:    y_w . (g x z_w) + y_v . (g x z_v)            (the sum over the cables is y . (g x z))
  dt, ds:  y_v . ((dt + ds) x z_w)   (at most (r_pc + r_s) |y_v| |z_w|, a product below)
  da_i: -w_i (P_i da_i / l_i) . n_i
  db_i: w_i db_i . (P_i n_i / l_i + u_i x z_w)

**Order 2** is kept as forms in dp, f and g: with u2(e) = -(u . e) P e / l^2 - |P e|^2 u / (2 l^2),
the second order of a unit vector,

  U2 = u2(dp + f x b) + P (f x (f x b)) / (2 l) - f x (P (dp + f x b) / l) + f x (f x u) / 2,
  sum_i w_i U2_i . n_i + w_i (P_i (dp + f x b_i) / l_i - f x u_i) . n_g,i,

bounded as |sum_kl dp_k f_l v' Q_kl v| <= r_bp F |(v' Q_kl v)_kl| and so on, where dp_k dp_l and
f_k f_l are six numbers with the weights 1 and sqrt(2).

**Remainder**, per cable. e = r_bp + F |b| and o = |da| + |db| bound the shift of q at first order,
E = (e + o) / l, which must stay below 0.9; r = r_pc + r_s.

- lin: |u^ - u - P (q^ - q) / l|. The sine s of the angle between u and u^ is at most E. The part
  along u is 1 - cos <= a s^2 with a = 1 / (1 + sqrt(1 - E^2)), that across is s |1 - |q^| / l| <=
  s (a s^2 + sqrt(E^2 - s^2)). With t = s^2 / E^2 the sum of their squares is at most
  E^4 (a^2 t^2 + t (1 - t) + 2 a E t^2 sqrt(1 - t) + a^2 E^2 t^3), where t^2 sqrt(1 - t) < 0.2863,
  and a^2 t^2 + t - t^2 <= 1 / (4 (1 - a^2)) if a^2 <= 1/2, else a^2. With e^f:
  |q^ - q - (its linear part)| <= F^2 |b| / 2 + F |db| =: o2, so lin is that sum plus o2 / l.
- chi = E sqrt(2 a) bounds |u^ - u|, the chord of that angle, and chi + F bounds |U - u|.
- mu = lin + F chi + F^2 / 2 + o / l bounds |U - u - (U1 without da, db)|, since
  U = u^ - f x u^ + O(F^2 / 2).
- |u^ - u - P (q^ - q) / l - u2(q^ - q)|: in the plane of u and q^ - q, (q^ - q) / l is a complex
  number zeta with |zeta| <= E, u is 1, and u^ = exp(i theta), theta = Im log(1 + zeta) =
  Im zeta - Im zeta^2 / 2 + r3 with |r3| <= E^3 / (3 (1 - E)) and |theta| <= E / sqrt(1 - E^2). So
  the difference is at most |theta|^3 / 6 + |r3| + |(Im zeta)^2 - theta^2| / 2, the last one at most
  (E^2 / 2 + |r3|) (E + |theta|) / 2.
- |u2(e)| <= |e|^2 / (sqrt(3) l^2), hence |u2(e + o) - u2(e)| <= (2 |e| |o| + |o|^2) / (sqrt(3)
  l^2); here with o + o2 in place of o.
- |e^f - 1 - fx - fx fx / 2| <= F^3 / 6, |e^f - 1 - fx| <= F^2 / 2, |e^f - 1| <= F. So
  U - u - U1 - U2 is at most the last two bounds plus (F^3 |b| / 6 + F |db|) / l + F (lin + o / l) +
  F^2 chi / 2 + F^3 / 6, which goes with |n|.
- |n_g| <= G |n| + G |c| |z_w|, as n_g = g x n - z_w x (g x c); it goes with mu.
- N - n - n_g - m = r_N: (e^g - 1 - gx) applied to z as to a twist, at most G^2 |n| / 2 +
  G^2 |c| |z_w|, and G (r + |db|) |z_w|. Both go with |U - u|. With u itself the first sums to
  at most G^2 (|y_v| |z_v| + |y_w| |z_w|) / 2, r's part of the second to G r |y_v| |z_w|, and
  G |db| |z_w| stays for each cable.
- (U - u) . m: with m's part of dt and ds, -f x u sums to at most F r |y_v| |z_w|; P dp / l to
  r_bp r |(sum_i w_i P_i / l_i) | |z_w| and P (f x b) / l likewise, in the norm of all nine numbers,
  each linear in v; what is left of U - u is at most mu. m's part of db: (chi + F) |db| |z_w|.

**Blocks.** What is left are sums of two kinds of terms, and each is bounded by a quadratic form for
any choice of its free parameter:

  c |a v| |b v|           <= c / 2 v' (t a'a + b'b / t) v           for every t > 0,
  r |(v' S_k v)_k|        <= r / 2 v' (Z + sum_k S_k Z^-1 S_k) v    for every Z > 0,

the second since y . (v' S_k v)_k = sum_k (y_k Z^1/2 v) . (Z^-1/2 S_k v) for a unit vector y. The
first three vectors lie in boxes besides, |y_k - m_k| <= h_k: then y_k = m_k + e_k with
sum_k p_k (e_k / h_k)^2 <= 1 for any p > 0 of sum 1, so that sum_k y_k v' S_k v is
sum_k m_k v' S_k v plus such a term with h_k S_k / sqrt(p_k) and r = 1. If the sum H of all these
forms and of 1 - Pi_c has its largest eigenvalue below 1, the criterion holds on the piece, and
1 - that eigenvalue is a lower bound of the margin.

The stability criterion Pi at a pose: what is asked, the matrix, its gradient, closed forms.

Source: servoing thesis (3.1), (3.8), (3.26) and 3.4; `matrix` is the plain form that the kernels
are tested against.

How wrong a servo's model may be: bounds on perturbations, and draws within them.

A perturbation is a vector of 18 + 6 m numbers: platform pose, camera pose, object pose (rotation
vector [rad], translation [m] each), exit points and anchor points [m].

Source: servoing thesis 3.2 and tables A.8 to A.18.

Verdicts on poses, of growing weight: sampled, searched, certified.

Source: servoing thesis 3.3 for sampling; the certificate is this project's own, see
`stability`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
