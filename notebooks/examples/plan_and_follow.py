"""Plan and follow: the fastest motion along a path, tracked by computed torque."""

import cdpr_drake as cdpr

robot = cdpr.load_robot("acrobot_large")
poses = [cdpr.Pose(position=p) for p in ([0.0, 0.0, 0.3], [0.15, 0.0, 0.35], [0.15, 0.1, 0.3])]
plan = cdpr.plan_path(robot, poses, speed=0.5, stations=200, track=True)
print(plan)
plan.plot().savefig("plan.png")
