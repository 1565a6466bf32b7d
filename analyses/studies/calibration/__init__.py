"""Study: how well robots are calibrated from a tracker, from the camera on board, from winches.

It repeats simulated calibrations over seeds: errors beside the Cramer-Rao bound, beside the
covariance that each reports, and what a visual servo gains from a calibrated robot.
"""
