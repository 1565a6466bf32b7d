"""Section `pose_plan` of a visual servo: a planned way to where the target is seen as desired."""
