import numpy as np
import pytest

from cdpr_drake.analyses.calibration.log_file import read_log
from cdpr_drake.analyses.calibration.tag_file import read_tags
from cdpr_drake.errors import CalibrationError
from cdpr_drake.geometry.poses import pose_from_angles

CABLES = ("C1", "C2")


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "log.csv"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    "header",
    [
        "C1_length_m,C2_length_m",
        "l1,l2",
        "L_1 [m], L_2 [m]",
        "cable1_length,cable2_length",
        "length_c1_m,length_c2_m",
        "length_0,length_1",
        "1_length_m,2_length_m",
        "measured_lengths_C1_m,measured_lengths_C2_m",
    ],
)
def test_headers_of_lengths_are_understood(written, header):
    log = read_log(written(f"{header}\n1.5,2.5\n"), CABLES)
    np.testing.assert_allclose(log.lengths, [[1.5, 2.5]])


def test_units_separators_and_gaps(written):
    header = "time_ms;l1_mm;tension_1 (kN);C2_swivel_deg;x_mm;y_mm;z_mm;phi_deg;theta_deg;psi_deg;n"
    log = read_log(
        written(f"# robot\n{header}\n" + "0;1,5;0,1;90;1;2;3;0;0;90;7\n10;;;;;;;;;;\n"), CABLES
    )
    np.testing.assert_allclose(log.time, [0.0, 0.01])
    np.testing.assert_allclose(log.lengths, [[0.0015, np.nan], [np.nan, np.nan]])
    assert log.tensions[0, 0] == 100.0
    assert log.swivels[0, 1] == pytest.approx(np.pi / 2)
    expected = pose_from_angles(np.array([0.001, 0.002, 0.003]), np.array([0, 0, np.pi / 2]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-12)
    assert log.poses[1] is None
    assert log.remarks == ("columns not read: n",)


def test_rotations_of_every_kind_agree(written):
    angle = 0.3
    half = f"{np.cos(angle / 2):.15f},0,0,{np.sin(angle / 2):.15f}"
    rows = {
        "qw,qx,qy,qz": half,
        "phi,theta,psi": f"0,0,{angle}",
        "rx,ry,rz": f"0,0,{angle}",
        "roll,pitch,yaw": f"0,0,{angle}",
    }
    for header, row in rows.items():
        log = read_log(written(f"x,y,z,{header}\n1,2,3,{row}\n"), CABLES)
        expected = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, angle]))
        assert log.poses[0].IsNearlyEqualTo(expected, 1e-9), header


def test_numbers_without_a_header_are_lengths_and_swivel_angles(written):
    log = read_log(written("0.1 0.2 0.3 0.4\n0.5 0.6 0.7 0.8\n"), CABLES)
    np.testing.assert_allclose(log.lengths, [[0.1, 0.2], [0.5, 0.6]])
    np.testing.assert_allclose(log.swivels, [[0.3, 0.4], [0.7, 0.8]])


def test_corners_of_tags(written):
    names = [f"tag7_{a}{c}_px" for c in range(1, 5) for a in "uv"]
    log = read_log(written(",".join(names) + "\n" + ",".join("12345678") + "\n"), CABLES)
    np.testing.assert_allclose(log.corners[7], np.arange(1.0, 9.0).reshape(1, 4, 2))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty log"),
        ("# nothing\n\n", "empty log"),
        ("l1,l2\n", "a header without rows"),
        ("l1,l2\n1,nan\n", ":2: l2: found nan"),
        ("l1,l2\n1,inf\n", ":2: l2: found inf"),
        ("l1,l2\n1,2\n1,x7\n", ":3: l2: found x7"),
        ("l1,l2\n1,2,3\n", "found 3 cells"),
        ("l1,C1_length_m\n1,2\n", "twice"),
        ("a,b\n1,2\n", "columns: found a, b"),
        ("1 2 3\n", "3 columns without a header"),
        ("x,y,z,qw,l1\n1,2,3,1,1\n", "quaternion: found 1 columns"),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,2,0,0,0\n", "quaternion: found length 2"),
        ("x,y,qw,qx,qy,qz\n1,2,1,0,0,0\n", "position: found 2 columns"),
        ("t,l1\n0,1\n0,2\n", "times that grow"),
        ("tag0_u1,tag0_v1\n1,2\n", "2 of 8 coordinates"),
    ],
)
def test_bad_logs_are_named(written, text, words):
    with pytest.raises(CalibrationError) as problem:
        read_log(written(text), CABLES)
    assert words in str(problem.value)
    assert "accepted" in str(problem.value)
    assert len(str(problem.value)) <= 500


def test_tags_with_and_without_a_place(written):
    tags = read_tags(
        written("tag,size_mm,x_m,y_m,z_m,phi_deg,theta_deg,psi_deg\n3,60,1,0,0,0,0,0\n4,50,,,,,,\n")
    )
    assert tags[3][0] == pytest.approx(0.06)
    assert tags[3][1].translation()[0] == 1.0
    assert tags[4][:2] == (pytest.approx(0.05), None)
    with pytest.raises(CalibrationError, match="size > 0"):
        read_tags(written("tag,size_m\n3,0\n"))
