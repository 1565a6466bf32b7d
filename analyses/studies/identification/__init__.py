"""Study: how well a robot's dynamics are identified, and what that is worth to its control.

`study_identification` repeats identifications over seeds: errors beside the covariance that each
reports and beside the Cramer-Rao bound, designed excitations beside random ones, and simulated
campaigns whose robot tracks a motion with what was found.
"""
