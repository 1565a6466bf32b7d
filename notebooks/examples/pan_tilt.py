"""Pan-tilt camera: from how many starts it keeps the target in view, and how many a fixed one.

`python pan_tilt.py 50` draws fifty starts in the whole workspace of ACROBOT.
"""

import sys

import numpy as np

import cdpr_drake as cdpr

LOWER, UPPER = (-0.1, -0.15, 0.3), (0.25, 0.15, 0.5)  # corners of the box of starts [m]
TURNS = (15.0, 15.0, 30.0)  # largest angles about x, y and z [deg]
SET = ["integration.engine=compiled", "tension_management=null"]


def approach(seed, changes):
    """A run from a start that the seed draws; None if a fixed camera does not see the tag there."""
    random = np.random.default_rng([seed, 401])
    position = random.uniform(LOWER, UPPER).round(4).tolist()
    angles = (random.uniform(-1.0, 1.0, 3) * TURNS).round(2).tolist()
    start = f"initial_pose={{position: {position}, angles_deg: {angles}}}"
    try:
        return cdpr.simulate("acrobot_pan_tilt", [f"seed={seed}", start, *changes, *SET])
    except cdpr.CdprError as problem:
        if "the camera does not see the target at the start" not in str(problem):
            raise
        return None


count = int(sys.argv[1]) if sys.argv[1:] else 4
for camera, changes in {"fixed": ["camera.pan_tilt=null"], "pan-tilt": []}.items():
    column = "found" if changes else "turned_found"  # of the image itself
    for scheme in ("pbvs", "pbvs-line"):
        scheme_changes = [f"controller.scheme={scheme}", *changes]
        runs = [run for k in range(count) if (run := approach(k, scheme_changes)) is not None]
        views = [run.log[column][1:, 0] > 0.0 for run in runs]  # row 0 is before the first image
        keeping = sum(view[np.argmax(view) :].all() for view in views)
        errors = [
            run.as_dict()["final_position_error_m"]
            for run in runs
            if run.as_dict()["outcome"] == "converged"
        ]
        print(
            f"{camera}, {scheme}: {count} starts; the tag is seen from {len(runs)} and kept in view"
            f" from {keeping}; {len(errors)} arrive within {1e3 * max(errors, default=0.0):.2f} mm"
        )
        if camera == "pan-tilt":
            joints = [run.as_dict()["pan_tilt"] for run in runs]
            seen = max(each["first_seen_s"] for each in joints)
            off = np.median([each["off_center_px"]["median"] for each in joints])
            turn = max(max(each["largest_angles_deg"]) for each in joints)
            print(
                f"    seen after {seen:.1f} s at most; {off:.1f} px off the middle in the median;"
                f" joints turn {turn:.0f} deg at most"
            )
