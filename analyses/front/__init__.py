"""The verbs of `import cdpr_drake as cdpr`: one call for each question about a robot.

Each takes a robot by name, by path or as a Robot, poses as a RigidTransform, a matrix of shape
(4, 4), a `Pose`, or None for the home pose, and returns a result that shows itself in a few lines,
has `as_dict()` for JSON, and mostly `plot()`. The subcommands of `cdpr` call the same functions:
they turn words into arguments, and results into tables and files.

The rooms below hold the mathematics, and what these functions leave out.
"""
