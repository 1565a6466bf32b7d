"""What a run leaves in its folder: summary, log, scenario, figures, replay, film."""

import csv
import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.servo_figures import FILM, write_film
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario

SHORT = ("camera.kind=projected", "integration.engine=compiled")

SUMMARY_KEYS = {
    "scenario", "robot", "controller", "estimator", "camera", "seed", "outcome", "sim_time_s",
    "wall_time_s", "realtime_factor", "final_position_error_m", "final_rotation_error_rad",
    "final_pose_estimate_error_m", "final_pose_estimate_error_rad", "image_deviation_px",
    "camera_deviation_m", "tension_n", "slack_cable_seconds",
}  # fmt: skip
FIGURES = ("image_path", "error", "cable_velocities", "cable_lengths", "tensions", "platform_path")


def written(result, folder, film=True):
    """A folder with the files of a run."""
    with Folder(folder, {}) as results:
        with results.files() as stage:
            result.write_inputs(stage)
        result.write(results)
        films = {FILM: lambda path: write_film(result, path)} if film else {}
        result.draw(results, exports=films)
    assert result.failed == {}
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    result = ServoRun(load_scenario("acrobot_pbvs", [*SHORT, "duration=0.4"])).simulate()
    return written(result, tmp_path_factory.mktemp("run")), result


def test_summary_has_the_promised_keys(run):
    summary = json.loads((run[0] / "summary.json").read_text())
    assert summary.keys() >= SUMMARY_KEYS
    assert summary["controller"] == "pbvs"
    assert summary["estimator"] == "control_integration"
    assert summary["tension_n"].keys() == {"min", "max"}
    for key in ("image_deviation_px", "camera_deviation_m"):
        assert summary[key].keys() == {"max", "mean"}


def test_npz_and_csv_hold_the_same_log(run):
    folder, result = run
    with np.load(folder / "log.npz") as arrays:
        assert set(arrays) == set(result.log)
        table = np.column_stack([arrays[name] for name in result.log])
    with (folder / "log.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == list(result.columns()) == list(result.to_dataframe())
    assert len(set(rows[0])) == len(rows[0])
    np.testing.assert_array_equal(np.array(rows[1:], float), table)


def test_the_written_scenario_runs_again_to_the_same_bytes(run, tmp_path):
    folder, _ = run
    again = ServoRun(load_scenario(str(folder / "scenario.yaml"))).simulate()
    written(again, tmp_path, film=False)
    for name in ("log.npz", "log.csv", "scenario.yaml", "robot.yaml"):
        assert (folder / name).read_bytes() == (tmp_path / name).read_bytes(), name


@pytest.mark.parametrize("name", FIGURES)
def test_figure_is_a_picture_with_something_in_it(run, name):
    picture = cv2.imread(str(run[0] / f"{name}.png"))
    assert np.all(picture.shape > np.array([400, 800, 2]))
    assert np.std(picture) > 5.0


def test_replay_shows_what_the_film_shows_and_where_the_target_should_be(run):
    page = (run[0] / "replay.html").read_text()
    assert 'src="http' not in page  # no server is needed
    (words,) = re.findall(r'id="cdpr-data">(.*?)</script>', page, re.DOTALL)
    camera, servo = json.loads(words)["camera"], run[1].built
    times = [time for time, _ in camera["images"]]
    np.testing.assert_allclose(times, [0.0, 0.2, 0.4])
    assert all(image.startswith("data:image/jpeg;base64,") for _, image in camera["images"])
    ((begins, desired),) = camera["desired"]
    assert begins == 0.0
    exactly = servo.pinhole.project(servo.X_CdO @ servo.target.points)
    np.testing.assert_allclose(np.reshape(desired, (-1, 2)).T, exactly)


def test_replay_holds_the_motion(run, tmp_path):
    """A page without a recording would be as long for one row as for all."""
    result = run[1]
    first = {name: values[:1] for name, values in result.log.items()}
    write_replay(tmp_path / "still.html", result.built.robot, first, result.built.scenario)
    still = (tmp_path / "still.html").stat().st_size
    frames = 10  # of 0.4 s at 25 Hz, beyond the first
    bytes_per_pose = 7 * 8
    assert (run[0] / "replay.html").stat().st_size - still > frames * bytes_per_pose


def test_film_has_a_frame_per_image(run):
    film = cv2.VideoCapture(str(run[0] / "camera.mp4"))
    frames, width = (
        film.get(what) for what in (cv2.CAP_PROP_FRAME_COUNT, cv2.CAP_PROP_FRAME_WIDTH)
    )
    assert (frames, width) == (11, 640)
    found, frame = film.read()
    assert found
    assert np.std(frame) > 5.0


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("acrobot_circles", ["ellipses_px.u0_px", "ellipses_px.n11_1_px2", "error.n20_0"]),
        ("acrobot_hybrid", ["corners_px.u3_px", "error.xo", "error.rz_rad", "error.z_m"]),
        ("acrobot_eye_to_hand", ["corners_px.v3_px", "error.rx_rad"]),
    ],
)
def test_other_schemes_leave_the_same_files_with_their_own_columns(name, expected, tmp_path):
    result = ServoRun(load_scenario(name, [*SHORT, "duration=0.1"])).simulate()
    written(result, tmp_path, film=name == "acrobot_circles")  # whose marks are others
    assert {path.name for path in tmp_path.glob("*.png")} >= {f"{name}.png" for name in FIGURES}
    columns = (tmp_path / "log.csv").read_text().partition("\n")[0].split(",")
    assert set(expected) <= set(columns)
    assert len(set(columns)) == len(columns)


def test_a_users_robot_is_named_in_the_place_of_the_scenarios_title(run, tmp_path):
    """Figures of one's own robot once said ACROBOT."""
    assert "ACROBOT approaches" in run[1].plot("tensions").get_suptitle()
    text = robot_file("acrobot_small").read_text()
    (tmp_path / "hall.yaml").write_text(text.replace("name: acrobot_small", "name: hall"))
    scenario = load_scenario("acrobot_pbvs", [f"robot={tmp_path / 'hall.yaml'}"])
    mine = ServoRun(scenario)
    mine.log = run[1].log
    words = "Tensions of the cables\n(hall, acrobot_pbvs, pulleys ignored, rendered camera, seed 0)"
    assert mine.plot("tensions").get_suptitle() == words
    own = ServoRun(replace(scenario, name="approach", title="HALL approaches a tag"))
    assert own.title("Paths").startswith("Paths\nHALL approaches a tag\n(approach, ")


def test_a_figure_that_fails_is_named_and_the_others_are_there(run, tmp_path, monkeypatch):
    """Data comes first; what fails after it takes nothing with it, and leaves no half file."""
    figures = run[1].figures()

    def fail():
        raise RuntimeError("no font\nmore words")

    drawn = {"error": fail, "tensions": figures["tensions"]}
    monkeypatch.setattr(ServoRun, "figures", lambda _: drawn)
    with Folder(tmp_path, {}) as results:
        run[1].draw(results)
    assert run[1].failed == {"error.png": "no font"}
    assert {path.name for path in tmp_path.glob("[!.]*")} == {"tensions.png", "replay.html"}


def test_no_figure_is_begun_after_a_request_to_stop(run, tmp_path):
    with Folder(tmp_path, {}) as results:
        run[1].draw(results, follow=Follow(stop=lambda: True))
    assert list(tmp_path.iterdir()) == []
