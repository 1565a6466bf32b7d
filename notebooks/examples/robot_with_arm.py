"""A robot with an arm: tensions that hold both, and how they change with the arm."""

import numpy as np

import cdpr_drake as cdpr

mechanism = cdpr.load_mechanism("arm_on_platform")
print(mechanism)
for shoulder in np.linspace(-0.6, 0.6, 3):
    joints = {"shoulder": float(shoulder), "elbow": -0.4}
    held = cdpr.solve_tensions(mechanism, joints=joints)
    print(f"shoulder {shoulder:+.1f} rad: {held.tensions.round(1)} N")
print(cdpr.solve_static(mechanism, joints={"shoulder": 0.3}))
