import numpy as np
import pytest

from cdpr_drake.analyses.fits.tags import read_tags
from cdpr_drake.analyses.logs.measurements import read_measurements
from cdpr_drake.errors import CalibrationError, LogFileError
from cdpr_drake.geometry.poses import pose_from_angles

CABLES = ("C1", "C2")


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "log.csv"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def read(written):
    return lambda text: read_measurements(written(text), CABLES)


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
def test_headers_of_lengths_are_understood(read, header):
    log = read(f"{header}\n1.5,2.5\n")
    np.testing.assert_allclose(log.lengths, [[1.5, 2.5]])


def test_units_separators_and_gaps(read):
    header = "time_ms;l1_mm;tension_1 (kN);C2_swivel_deg;x_mm;y_mm;z_mm;phi_deg;theta_deg;psi_deg;n"
    log = read(f"# robot\n{header}\n" + "0;1,5;0,1;90;1;2;3;0;0;90;7\n10;;;;;;;;;;\n")
    np.testing.assert_allclose(log.time, [0.0, 0.01])
    np.testing.assert_allclose(log.lengths, [[0.0015, np.nan], [np.nan, np.nan]])
    assert log.tensions[0, 0] == 100.0
    assert log.swivels[0, 1] == pytest.approx(np.pi / 2)
    expected = pose_from_angles(np.array([0.001, 0.002, 0.003]), np.array([0, 0, np.pi / 2]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-12)
    assert log.poses[1] is None
    assert log.remarks == ("columns not read: n",)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("qw,qx,qy,qz", f"{np.cos(0.15):.15f},0,0,{np.sin(0.15):.15f}"),
        ("phi,theta,psi", "0,0,0.3"),
        ("rx,ry,rz", "0,0,0.3"),
        ("roll,pitch,yaw", "0,0,0.3"),
    ],
)
def test_rotations_of_every_kind_agree(read, header, row):
    log = read(f"x,y,z,{header}\n1,2,3,{row}\n")
    expected = pose_from_angles(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.3]))
    assert log.poses[0].IsNearlyEqualTo(expected, 1e-9)


def test_numbers_without_a_header_are_lengths_and_swivel_angles(read):
    log = read("0.1 0.2 0.3 0.4\n0.5 0.6 0.7 0.8\n")
    np.testing.assert_allclose(log.lengths, [[0.1, 0.2], [0.5, 0.6]])
    np.testing.assert_allclose(log.swivels, [[0.3, 0.4], [0.7, 0.8]])


def test_roll_pitch_and_yaw_without_a_position_are_an_inclination(read):
    log = read("C1_length_m,roll_deg,pitch_deg,yaw_deg\n1,10,20,30\n1,,,\n")
    assert log.poses is None
    np.testing.assert_allclose(log.tilts[0], np.radians([10.0, 20.0, 30.0]))
    assert np.isnan(log.tilts[1]).all()
    alone = read("C1_length_m,pitch_rad\n1,0.2\n")
    np.testing.assert_allclose(alone.tilts, [[np.nan, 0.2, np.nan]])


def test_other_rotations_without_a_position_are_one_too(read):
    half = np.radians(15.0)
    log = read(f"C1_length_m,qw,qx,qy,qz\n1,{np.cos(half)},{np.sin(half)},0,0\n")
    np.testing.assert_allclose(log.tilts, [[np.radians(30.0), 0.0, 0.0]], atol=1e-12)
    log = read("C1_length_m,phi_deg,theta_deg,psi_deg\n1,0,0,40\n")
    np.testing.assert_allclose(log.tilts, [[0.0, 0.0, np.radians(40.0)]], atol=1e-12)


@pytest.mark.parametrize("nothing", ["nan", "NA", "null", "", "-"])
def test_words_for_nothing_measured(read, nothing):
    log = read(f"l1,l2\n1,{nothing}\n2,3\n")
    np.testing.assert_array_equal(log.lengths, [[1.0, np.nan], [2.0, 3.0]])


def test_cables_with_other_names_are_bound_by_their_order_and_a_remark_says_so(read):
    log = read("C1_length_m,E_length_m\n1,2\n")
    np.testing.assert_array_equal(log.lengths, [[1.0, 2.0]])
    assert "E is C2" in log.remarks[0]
    with pytest.raises(LogFileError, match="cables: found A, B, D; accepted: those of the robot"):
        read("A_length_m,B_length_m,D_length_m\n1,2,3\n")


def test_corners_of_tags(read):
    names = [f"tag7_{a}{c}_px" for c in range(1, 5) for a in "uv"]
    log = read(",".join(names) + "\n" + ",".join("12345678") + "\n")
    np.testing.assert_allclose(log.corners[7], np.arange(1.0, 9.0).reshape(1, 4, 2))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "an empty file"),
        ("# nothing\n\n", "found no rows"),
        ("l1,l2\n", "a header without rows"),
        ("l1,l2\n1,inf\n", ":2: l2: found 'inf'"),
        ("l1,l2\n1,2\n1,x7\n", ":3: l2: found 'x7'"),
        ("l1,l2\n1,2,3\n", "found 3 cells"),
        ("l1,C1_length_m\n1,2\n", "twice"),
        ("a,b\n1,2\n", "columns: found a, b"),
        ("1 2 3\n", "3 columns of numbers without a header"),
        ("x,y,z,qw,l1\n1,2,3,1,1\n", "quaternion: found 1 columns"),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,2,0,0,0\n", "quaternion: found length 2"),
        ("x,y,qw,qx,qy,qz\n1,2,1,0,0,0\n", "position: found 2 columns"),
        ("t,l1\n0,1\n0,2\n", "times that grow"),
        ("tag0_u1,tag0_v1\n1,2\n", "2 of 8 coordinates"),
    ],
)
def test_bad_logs_are_named(read, text, words):
    with pytest.raises(LogFileError) as problem:
        read(text)
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
