"""Every trap of the real logs that a log can show is found by `check`, and nothing untrue is said."""

import csv
from functools import cache

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.model.robot_file import load_robot, robot_from_dict
from omnidyn.statement import ERROR

ROBOTINO = load_robot("robotino")
POSE = ("x=xpos:1.84 mm", "y=ypos:1.84 mm")


@cache
def robotino(path, unsigned=True, pose=True):
    """The verdict on one Robotino log; the current gets the sign of the commanded speed where asked."""
    options = LogOptions(overrides=POSE if pose else (), current_unsigned=unsigned)
    return check(recorded_log(path, ROBOTINO, options), ROBOTINO)


@pytest.fixture(scope="session")
def gray(data):
    return data / "robotino" / "one_surface_type" / "gray_surface"


@pytest.fixture(scope="session")
def green(data):
    return data / "robotino" / "one_surface_type" / "green_surface"


def some(folder, first, last, step):
    return [folder / f"exp{n:02d}.csv" for n in range(first, last, step)]


def grave(verdict):
    return {finding.code for finding in verdict.findings if finding.severity != "note"}


# ---- Robotino ----


def test_the_current_is_unsigned_with_its_step(gray):
    verdict = robotino(gray / "exp35.csv", unsigned=False, pose=False)
    (unsigned,) = verdict.of("unsigned")
    assert unsigned.severity == "error"
    steps = [finding.numbers["step"] for finding in verdict.of("quantised") if finding.subject.startswith("i")]
    assert steps == [pytest.approx(0.0256, abs=1e-4)]


def test_the_speed_counts_in_steps_and_the_slow_wheel_reads_0(gray):
    verdict = robotino(gray / "exp35.csv")
    (steps,) = [finding for finding in verdict.of("quantised") if finding.subject.startswith("w")]
    assert steps.numbers["step"] * 16 == pytest.approx(2.827, abs=1e-3)
    assert "2.827 rad/s" in str(steps)  # as it stands in the file, at the motor
    (slow,) = verdict.of("reads_zero")
    assert slow.subject == "w2"


@pytest.mark.parametrize("first, droop", [(0, 0.72), (72, 0.86), (144, 0.90)])
@pytest.mark.some(1)
def test_the_set_speed_is_not_reached(gray, first, droop):
    ratios = [robotino(path).of("droop")[0].numbers["ratio"] for path in some(gray, first, first + 72, 1)]
    assert np.mean(ratios) == pytest.approx(droop, abs=0.006)


def test_the_set_speed_is_not_reached_on_green(green):
    ratios = [robotino(path).of("droop")[0].numbers["ratio"] for path in some(green, 0, 71, 2)]
    assert np.mean(ratios) == pytest.approx(0.75, abs=0.006)


@pytest.mark.parametrize("first, path", [(0, 0.70), (72, 0.68), (144, 0.67)])
def test_the_robot_slips(gray, first, path):
    ratios = [robotino(each).of("path_ratio")[0].numbers["floor_ratio"] for each in some(gray, first, first + 72, 1)]
    assert np.mean(ratios) == pytest.approx(path, abs=0.02)


def test_the_robot_slips_more_on_green(green):
    ratios = [robotino(each).of("path_ratio")[0].numbers["floor_ratio"] for each in some(green, 0, 71, 2)]
    assert np.mean(ratios) == pytest.approx(0.45, abs=0.02)


def test_the_camera_has_a_frame_of_its_own(gray):
    # No source says so; the direction of travel in the picture against heading and wheels does, in every run alike.
    angles = [robotino(each).of("pose_frame")[0].numbers["angle_deg"] for each in some(gray, 0, 216, 18)]
    assert np.std(angles) < 20.0


def test_the_first_rows_are_the_start(gray):
    (start,) = robotino(gray / "exp35.csv").of("start_up")
    assert start.rows[0][0] == 4  # after three lines of header


def test_there_is_no_voltage_and_no_one_invents_it(gray):
    verdict = robotino(gray / "exp35.csv")
    assert "voltage" not in verdict.channels
    assert not {"energy", "saturation", "sag"} & grave(verdict)


def test_one_run_cannot_tell_viscous_from_dry_friction(gray):
    assert robotino(gray / "exp120.csv").of("one_speed")


def test_nothing_else_is_said_of_the_robotino(gray, green):
    allowed = {"droop", "path_ratio", "pose_frame", "reads_zero", "slip", "gap", "spike"}
    for path in [*some(gray, 0, 216, 1), *some(green, 0, 71, 2)]:
        verdict = robotino(path)
        assert not verdict.has_errors, path
        assert grave(verdict) <= allowed, path


def test_gaps_are_where_the_clock_jumps(gray):
    # The file itself: steps of more than four usual ones.
    with open(gray / "exp43.csv", encoding="utf-8") as stream:
        t = np.array([float(row[0]) for row in list(csv.reader(stream, delimiter=";"))[3:]])
    jumps = np.flatnonzero(np.diff(t) > 4.0 * np.median(np.diff(t)))
    (gap,) = robotino(gray / "exp43.csv").of("gap")
    assert [first - 4 for first, _ in gap.rows] == list(jumps)


def test_motors_off_the_ground_are_no_stuck_encoders(data):
    path = data / "robotino" / "dc_motor_model_identification" / "validation_data.csv"
    verdict = robotino(path, pose=False)
    assert grave(verdict) <= {"droop"}
    assert not verdict.has_errors


def test_a_recording_that_is_given_twice(data, gray, capsys):
    from omnidyn.cli import main

    twin = data / "robotino" / "dc_motor_model_identification" / "gray_0.1_175_validation.csv"
    main(["check", str(gray / "exp35.csv"), str(twin), "--robot", "robotino", "--current-unsigned"])
    out = capsys.readouterr().out
    assert "same_data" in out
    assert "exp35.csv" in out.split("same_data")[1]


# ---- udea ----

UDEA = robot_from_dict(
    {
        "schema": 1,
        "name": "udea",
        "body": {"mass_kg": 3.178, "inertia_kg_m2": 0.0156},
        "wheels": {"azimuth_deg": [150.0, 270.0, 30.0], "robot_radius_m": 0.099, "wheel_radius_m": 0.0325},
        # Motor and limit are not known; a duty without a supply makes no voltage, so nothing is computed from them.
        "motor": {
            "resistance_ohm": 3.0,
            "torque_constant_Nm_A": 0.02,
            "emf_constant_Vs_rad": 0.02,
            "gear_ratio": 20.0,
            "voltage_limit_V": 22.2,
        },
        "drive": {"kind": "duty"},
    }
)


@cache
def udea(path):
    return check(recorded_log(path, UDEA, LogOptions(assume={"u": "%"})), UDEA)


def test_positive_pwm_turns_the_heading_negative(data):
    verdict = udea(data / "udea_three_omni" / "rotation_tests" / "stage2_1.txt")
    (finding,) = verdict.of("inverted")
    assert finding.subject == "heading"
    assert "all wheels have the opposite sign" in str(finding)
    assert grave(verdict) == {"inverted"}


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_the_same_in_the_drives_through_all_their_noise(data, number):
    verdict = udea(data / "udea_three_omni" / "sensor_data" / f"exp{number}.txt")
    assert [finding.subject for finding in verdict.of("inverted")] == ["heading"]
    assert grave(verdict) <= {"inverted", "spike"}


def test_noise_steps_and_spikes_of_the_wheel_speed(data):
    verdict = udea(data / "udea_three_omni" / "sensor_data" / "exp1.txt")
    (steps,) = verdict.of("quantised")
    assert steps.numbers["step"] == pytest.approx(2.38, abs=0.01)
    assert 8.0 < steps.numbers["noise"] < 70.0
    assert "hidden in a noise" in str(steps)
    (spike,) = verdict.of("spike")
    assert abs(spike.numbers["farthest"]) == pytest.approx(381.0, abs=1.0)
    assert verdict.of("no_supply")


def test_the_last_row_has_no_duty(data):
    verdict = udea(data / "udea_three_omni" / "motor_tests" / "stage1_1.txt")
    assert [finding.rows for finding in verdict.of("last_row")] == [((1201, 1201),)]


@pytest.mark.parametrize("number", [1, 2, 3])
def test_the_camera_shoots_up_to_17_rad_per_s(data, number):
    path = data / "udea_three_omni" / "video_trajectories" / f"traj_vid_{number}.csv"
    verdict = check(recorded_log(path), UDEA)
    (burst,) = [finding for finding in verdict.of("burst") if finding.subject == "omega"]
    assert 16.0 < abs(burst.numbers["farthest"]) < 19.0
    # Nothing else but that vx and vy are the rates of x and y, whatever the heading is.
    (frame,) = verdict.of("twist_frame")
    assert frame.numbers["likeness"] > 0.99
    assert abs(frame.numbers["likeness_as_logged"]) < 0.6
    assert {finding.code for finding in verdict.findings if finding.severity == ERROR} == {"twist_frame"}


def test_a_heading_that_was_not_recorded(data):
    # In stage 1 the wheels turn at up to 45 % while alpha stays within 0.02 rad; in exp5 it is 0 from t = 10.2 s on.
    for path in ("motor_tests/stage1_1.txt", "motor_tests/stage1_2.txt", "sensor_data/exp5.txt"):
        (finding,) = udea(data / "udea_three_omni" / path).of("dead")
        assert finding.subject == "heading"


def test_the_drop_out_of_exp5(data):
    verdict = udea(data / "udea_three_omni" / "sensor_data" / "exp5.txt")
    assert verdict.of("time_repeats")[0].rows == ((1018, 1018),)
    assert verdict.of("gap")[0].rows[0][0] == 1007


# ---- ODrive ----


def odrive(data, name, step="0.000125 s"):
    options = LogOptions(overrides=(f"t=timestep (8Hz):{step}",))
    return check(recorded_log(data / "odrive_umn" / "demo_data" / f"{name}.csv", None, options))


@pytest.mark.parametrize("name", ["step1", "step2", "chirp1", "chirp2", "noise1", "noise2"])
def test_rows_of_nan_and_padding_and_nothing_else(data, name):
    verdict = odrive(data, name)
    assert 5 <= verdict.of("empty_rows")[0].count <= 20
    assert verdict.of("padding")[0].count == 11
    assert {"empty_rows", "padding"} <= grave(verdict) <= {"empty_rows", "padding", "gap"}
    if verdict.of("gap"):  # "irregular, up to 22 ms", four times the usual 5.4
        assert 0.019 < verdict.of("gap")[0].numbers["longest_s"] < 0.0235


def test_the_clock_of_the_header_is_wrong(data):
    # "8Hz" as stated: a row every 5 s.
    (finding,) = odrive(data, "step2", "0.125 s").of("time_unit")
    assert finding.severity == ERROR
