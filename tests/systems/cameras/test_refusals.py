"""Sections and files of cameras that make no sense are refused, by name."""

import pytest
import yaml

from cdpr_drake.errors import RobotFileError, ScenarioError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import check_loop

PAN_TILT, PBVS, RENDERED = "acrobot_pan_tilt", "acrobot_pbvs", "camera.kind=rendered"
BARREL = "{kind: brown_conrady, k1: -0.9}"

REFUSED = [
    (PAN_TILT, ["camera.pan_tilt.lower_deg=[80, -75]"], "camera.pan_tilt.lower_deg: found (80, -7"),
    (PAN_TILT, ["camera.pan_tilt.upper_deg=[200, 75]"], "camera.pan_tilt: found limits"),
    (PAN_TILT, ["camera.pan_tilt.start_deg=[0, 76]"], "camera.pan_tilt.start_deg: found (0, 76)"),
    (PAN_TILT, ["camera.pan_tilt.gain=0"], "camera.pan_tilt.gain"),
    (PAN_TILT, ["target.kind=circles", "controller.scheme=circles"], "target.kind: found circles"),
    (PAN_TILT, ["estimator.kind=fusion"], "overrides estimator.kind: found fusion with camera"),
    (PAN_TILT, ["estimator.compare=[fusion]"], "estimator.compare[0]: found fusion"),
    (PAN_TILT, ["adaptation={}"], "overrides adaptation: found a section with camera.pan_tilt"),
    (PAN_TILT, ["stability={}"], "overrides stability: found a section with camera.pan_tilt"),
    (PAN_TILT, [RENDERED, "camera.flaws={exposure: 0.01}"],
     "camera.flaws: found images that take time"),
    (PAN_TILT, ["integration.loop=compiled"], "its section camera.pan_tilt adds blocks"),
    (PBVS, [f"camera.distortion={BARREL}"], "camera.distortion: found a brown"),
    (PBVS, ["camera.distortion={kind: fisheye, k6: 1}"],
     "camera.distortion.k6: found 1 with kind"),
    (PBVS, ["camera.model=webcam"], "camera.model: camera 'webcam' is unknown"),
    (PBVS, ["perturbations.camera_model=webcam"], "perturbations.camera_model: camera 'webcam'"),
    (PBVS, [f"perturbations.camera_distortion={BARREL}"],
     "perturbations.camera_distortion: found a brown"),
    (PBVS, ["perturbations.camera_distortion={k2: 1}"],
     "perturbations.camera_distortion.k2: found"),
    (PBVS, [RENDERED, "camera.region=target", "perturbations.camera_model=astra"],
     "camera.region: found target with a camera that is believed to be another"),
    (PBVS, ["camera.kind=projected", "camera.flaws={noise: 1}"], "camera.flaws: found a section"),
    (PBVS, [RENDERED, "camera.region=target", "camera.flaws={noise: 1}"],
     "camera.flaws: found a section"),
    (PBVS, [RENDERED, "camera.flaws={readout: 0.05}"],
     "camera.flaws: found exposure and readout of 0.05 s"),
    (PBVS, ["camera.kind=projected", "camera.region=target"],
     "camera.region: found target with camera.kind projected"),
    (PBVS, [RENDERED, "camera.focus_zoom=0.1"], "camera.focus_zoom: found 0.1"),
    ("acrobot_pbvs_textured", ["target.texture=bricks"], "target.texture: found bricks"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "changes", "words"), REFUSED)
def test_a_scenario_without_sense_is_refused(name, changes, words):
    with pytest.raises(ScenarioError) as refused:
        check_loop(load_scenario(name, changes))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_projected_camera_may_zoom():
    assert load_scenario(PBVS, ["camera.kind=projected", "camera.focus_zoom=0.1"])


FILES = [
    ({"distortion": {"kind": "brown_conrady", "k1": -0.9}},
     "distortion: found a brown_conrady lens whose image folds over 31.3 deg from the axis"),
    ({"distortion": {"kind": "fisheye", "p1": 0.1}},
     "distortion.p1: found 0.1 with kind fisheye; accepted: 0, or k1, k2, k3, k4"),
    ({"distortion": {"k1": 0.1}}, "distortion.k1: found 0.1 with kind none"),
    ({"distortion": {"kind": "barrel"}}, "distortion.kind: found barrel"),
    ({"principal_point": [900.0, 3.0]}, "principal_point: found [900, 3]"),
]  # fmt: skip


@pytest.mark.parametrize(("more", "words"), FILES)
def test_a_camera_file_that_is_none_is_refused(tmp_path, more, words):
    own = {
        "name": "eye", "title": "A camera", "source": "a test", "width": 640, "height": 480,
        "view_angle_horizontal_deg": 63.0, "view_angle_vertical_deg": 50.0, "rate_hz": 30.0,
    }  # fmt: skip
    path = tmp_path / "eye.yaml"
    path.write_text(yaml.safe_dump(own | more), encoding="utf-8")
    with pytest.raises(RobotFileError, match=r"eye\.yaml") as refused:
        load_camera(str(path))
    assert words in str(refused.value)
