"""Without tags: where a servo comes to rest on textured squares, and on a tag of the same size.

`python tagless.py 20 5` takes twenty starts by pose-based servoing, and five by other schemes.
Images are rendered, which takes about ten seconds a run.
"""

import sys

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.geometry import pose_row, pose_rows_distance

TARGETS = {"tag": []}
for texture in ("stones", "map", "print"):
    TARGETS[texture] = ["target.kind=textured", f"target.texture={texture}"]
TIMES = ["duration=12", "stop.hold=24", "log_rate=25", "camera.rate=25"]
FAST = ["camera.region=target", "integration.engine=compiled"]


def starts(count):
    """The first starts of a random series from which the camera sees the target and a rim."""
    words = ["camera.kind=projected", "target.size=0.075"]  # 60 mm and the rim
    servo = cdpr.build_visual_servo(cdpr.load_scenario("acrobot_pbvs", words))
    nominal, random = servo.scenario.initial_pose, np.random.default_rng(11)
    poses = []
    while len(poses) < count:
        position = np.round(nominal.position + random.uniform(-0.03, 0.03, 3), 4)
        angles = np.round(nominal.angles_deg + random.uniform(-4.0, 4.0, 3), 2)
        pose = cdpr.Pose(position=position, angles_deg=angles)
        if servo.target.in_view(servo.X_CO(pose.transform(), 0.0), servo.pinhole):
            poses.append(pose)
    return poses


def errors(run):
    """Distance [mm] and angle [deg] of the platform from its goal at rest, root mean squares."""
    rest = run.log["time"] >= run.log["time"][-1] - 1.0
    goal = pose_row(run.built.desired_platform_pose())
    distances, angles = pose_rows_distance(run.log["X_WP"][rest], goal[np.newaxis])
    return 1e3 * np.sqrt(np.mean(distances**2)), np.degrees(np.sqrt(np.mean(angles**2)))


counts = [int(word) for word in sys.argv[1:]] or [1, 0]
for scheme in ("pbvs", "ibvs", "2.5d")[: 3 if counts[-1] else 1]:
    for target, changes in TARGETS.items():
        ends, missed = [], 0
        for seed, pose in enumerate(starts(counts[scheme != "pbvs"])):
            words = [f"controller.scheme={scheme}", f"seed={seed}", *changes, *TIMES, *FAST]
            words += [f"initial_pose.position={pose.position.tolist()}"]
            words += [f"initial_pose.angles_deg={pose.angles_deg.tolist()}"]
            run = cdpr.simulate("acrobot_pbvs", words)
            ends.append(errors(run))
            missed += np.sum(run.log["found"][1:] == 0.0)
        arrived = [end for end in ends if end[0] < 5.0]
        distance, angle = np.median(arrived or [(np.nan, np.nan)], axis=0)
        print(
            f"{scheme}, {target}: {len(arrived)} of {len(ends)} arrive, {distance:.3f} mm and"
            f" {angle:.3f} deg off in the median; target not found in {missed:.0f} images"
        )
