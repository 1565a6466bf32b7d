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
from cdpr_drake.analyses.runs import KINDS
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.servo_figures import FILM, write_film
from cdpr_drake.analyses.visualization.replay import write_replay
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario

SHORT = ("camera.kind=projected", "integration.engine=compiled")
FIGURES = ("image_path", "error", "cable_velocities", "cable_lengths", "tensions", "platform_path")


def written(scenario, folder, film=False):
    """A run of a scenario, and a folder with its files."""
    run = KINDS[scenario.kind](scenario).simulate()
    with Folder(folder, {}) as results:
        with results.files() as stage:
            run.write_inputs(stage)
        run.write(results)
        run.draw(results, exports={FILM: lambda path: write_film(run, path)} if film else {})
    assert run.failed == {}
    return folder, run


@pytest.fixture(scope="module")
def servo(tmp_path_factory):
    scenario = load_scenario("acrobot_pbvs", [*SHORT, "duration=0.4"])
    return written(scenario, tmp_path_factory.mktemp("run"), film=True)


@pytest.fixture(scope="module")
def tension(tmp_path_factory):
    scenario = load_scenario("caroca_computed_torque", ["duration=0.3"])
    return written(scenario, tmp_path_factory.mktemp("run"))


@pytest.mark.parametrize(("kind", "figures"), [("servo", FIGURES), ("tension", FIGURES[1:2])])
def test_a_folder_holds_one_log_and_pictures_and_runs_again_to_the_same_bytes(
    kind, figures, tmp_path, request
):
    folder, run = request.getfixturevalue(kind)
    assert json.loads((folder / "summary.json").read_text()) == run.as_dict()
    with np.load(folder / "log.npz") as arrays:
        assert set(arrays) == set(run.log)
        table = np.column_stack([arrays[name] for name in run.log])
    with (folder / "log.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == list(run.columns()) == list(run.to_dataframe())
    assert len(set(rows[0])) == len(rows[0])
    np.testing.assert_array_equal(np.array(rows[1:], float), table)
    for name in figures:
        picture = cv2.imread(str(folder / f"{name}.png"))
        assert np.all(picture.shape > np.array([400, 800, 2]))
        assert np.std(picture) > 5.0, name  # something is in it
    written(load_scenario(str(folder / "scenario.yaml")), tmp_path)
    for name in ("log.npz", "log.csv", "scenario.yaml", "robot.yaml"):
        assert (folder / name).read_bytes() == (tmp_path / name).read_bytes(), name


def test_replay_shows_the_motion_and_what_the_film_shows_and_where_the_target_should_be(
    servo, tmp_path
):
    folder, run = servo
    page = (folder / "replay.html").read_text()
    assert 'src="http' not in page  # no server is needed
    (words,) = re.findall(r'id="cdpr-data">(.*?)</script>', page, re.DOTALL)
    camera = json.loads(words)["camera"]
    np.testing.assert_allclose([time for time, _ in camera["images"]], [0.0, 0.2, 0.4])
    assert all(image.startswith("data:image/jpeg;base64,") for _, image in camera["images"])
    ((begins, desired),) = camera["desired"]
    assert begins == 0.0
    exactly = run.built.pinhole.project(run.built.X_CdO @ run.built.target.points)
    np.testing.assert_allclose(np.reshape(desired, (-1, 2)).T, exactly)
    # A page without a recording would be as long for one row as for all: 10 frames, 7 numbers.
    first = {name: values[:1] for name, values in run.log.items()}
    write_replay(tmp_path / "still.html", run.robot, first, run.scenario)
    assert len(page) - (tmp_path / "still.html").stat().st_size > 10 * 7 * 8


def blue_pixels(frame):
    """How many have the colour of the path in a film."""
    return np.count_nonzero((frame[..., 0] > 150) & (frame[..., 2] < 100))


def test_film_has_a_frame_per_image_and_a_path_that_grows(servo):
    film = cv2.VideoCapture(str(servo[0] / "camera.mp4"))
    count, width = (film.get(w) for w in (cv2.CAP_PROP_FRAME_COUNT, cv2.CAP_PROP_FRAME_WIDTH))
    assert (count, width) == (11, 640)
    frames = [film.read()[1] for _ in range(11)]
    assert np.std(frames[0]) > 5.0
    assert blue_pixels(frames[-1]) > blue_pixels(frames[0])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("acrobot_circles", ["ellipses_px.u0_px", "ellipses_px.n11_1_px2", "error.n20_0"]),
        ("acrobot_hybrid", ["corners_px.u3_px", "error.xo", "error.rz_rad", "error.z_m"]),
        ("acrobot_eye_to_hand", ["corners_px.v3_px", "error.rx_rad"]),
    ],
)
def test_other_schemes_leave_the_same_files_with_their_own_columns(name, expected, tmp_path):
    scenario = load_scenario(name, [*SHORT, "duration=0.1"])
    written(scenario, tmp_path, film=name == "acrobot_circles")  # whose marks are others
    assert {path.name for path in tmp_path.glob("*.png")} >= {f"{name}.png" for name in FIGURES}
    columns = (tmp_path / "log.csv").read_text().partition("\n")[0].split(",")
    assert set(expected) <= set(columns)
    assert len(set(columns)) == len(columns)


def test_a_users_robot_is_named_in_the_place_of_the_scenarios_title(servo, tmp_path):
    """Figures of one's own robot once said ACROBOT."""
    assert "ACROBOT approaches" in servo[1].plot("tensions").get_suptitle()
    text = robot_file("acrobot_small").read_text()
    (tmp_path / "hall.yaml").write_text(text.replace("name: acrobot_small", "name: hall"))
    scenario = load_scenario("acrobot_pbvs", [f"robot={tmp_path / 'hall.yaml'}"])
    mine = ServoRun(scenario)
    mine.log = servo[1].log
    words = "Tensions of the cables\n(hall, acrobot_pbvs, pulleys ignored, rendered camera, seed 0)"
    assert mine.plot("tensions").get_suptitle() == words
    own = ServoRun(replace(scenario, name="approach", title="HALL approaches a tag"))
    assert own.title("Paths").startswith("Paths\nHALL approaches a tag\n(approach, ")


def test_no_figure_is_begun_after_a_request_to_stop(servo, tmp_path):
    with Folder(tmp_path, {}) as results:
        servo[1].draw(results, follow=Follow(stop=lambda: True))
    assert list(tmp_path.iterdir()) == []
    assert servo[1].failed == {}
