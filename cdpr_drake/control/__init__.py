"""Control of the platform by wrenches, tensions and torques.

Computed torque in task space: w = M (a_d + Kd e_v + Kp e) + C v - f_g as a spatial force on the
platform about Po in W; or its force alone, as on a point mass, where moments are not held
(`force_balance`). Visual servoing by torque: the servo's wanted twist gives a wanted
acceleration, that a wrench, that tensions, and these motor torques by a loop around measured
tensions; `TorqueServoLaw` is all of it. `goal_pose` is where a camera sees that the platform shall
be, `GoalPlan` how it gets there.

Source: Gazebo thesis 6.1, (2.24) for (2.17), whose sign is wrong; servoing thesis 5.2.3, 5.2.4,
(5.7) with the sign and the bars that are missing in print, (5.9) as X_C*O is meant.
"""
