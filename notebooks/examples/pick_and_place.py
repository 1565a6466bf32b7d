"""Pick and place: where a box is set down, with its goal in view, hidden, or not seen past the box.

`python pick_and_place.py 20 rendered` takes twenty seeds and rendered images, over an hour.
"""

import sys

import numpy as np

import cdpr_drake as cdpr

CASES = {
    "in view": "cover=null",
    "hidden for 3 s while carried": "cover={phase: carry, delay: 0.5, duration: 3.0}",
    "hidden for 3 s while lowered": "cover={phase: lower, delay: 0.5, duration: 3.0}",
    "seen by one camera, whose view the box fills": "goal_camera=null",
}

count = int(sys.argv[1]) if sys.argv[1:] else 1
camera = sys.argv[2] if sys.argv[2:] else "projected"
for case, change in CASES.items():
    words = [change, f"camera.kind={camera}"]
    runs = [
        cdpr.simulate("acrobot_pick_and_place", [*words, f"seed={seed}"]) for seed in range(count)
    ]
    placed = [run.as_dict() for run in runs if run.as_dict()["outcome"] == "completed"]
    print(f"goal {case}: {len(placed)} of {count} boxes are set down")
    if placed:
        errors = 1e3 * np.array([numbers["set_down_error_m"] for numbers in placed])
        angle = np.degrees(max(numbers["set_down_error_rad"] for numbers in placed))
        unseen = np.mean([numbers["views"]["unseen_s"] for numbers in placed])
        print(
            f"    {np.median(errors):.2f} mm from the goal in the median, at most"
            f" {errors.max():.2f} mm and {angle:.2f} deg; {unseen:.1f} s without the tag"
        )
    for run in runs:
        if run.as_dict()["outcome"] != "completed":
            print(f"    seed {run.as_dict()['seed']}: {run.as_dict()['message']}")
