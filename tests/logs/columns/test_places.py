"""Which wheel a place in a name means: front_left, fl, leftFront, rear_right_wheel_joint."""

import numpy as np
import pytest

from omnidyn import load_robot
from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.table.table import FileTable
from omnidyn.model.first_guess import first_guess
from omnidyn.model.wheels import Wheels
from tests.support.codes import said

FL, FR, RL, RR = 45.0, -45.0, 135.0, -135.0


def table(*names):
    columns = {"t_s": np.arange(5) * 0.01} | {name: np.sin(np.arange(5.0) + k) for k, name in enumerate(names)}
    return FileTable(tuple(columns), columns, np.arange(5), {}, "log.csv", "")


def mapped(*names, robot=None):
    found = guess_columns(table(*names), robot)
    return {key: column.name for key, column in found.columns.items() if key != "t"}


@pytest.mark.parametrize(
    "name, place",
    [
        ("front_left_wheel", FL),
        ("left_front_wheel_velocity", FL),
        ("fl_vel_rad_s", FL),
        ("wheelFL_rad_s", FL),
        ("leftFrontPower", FL),
        ("FLPower", FL),
        ("/joint_states/front_left_wheel_joint/velocity", FL),
        ("frontRight", FR),
        ("w_rf", FR),
        ("frspeed", FR),
        ("rl_rpm", RL),
        ("back_left_current_A", RL),
        ("lr_wheel", RL),
        ("rear_right_wheel_joint", RR),
        ("back_right_wheel_joint/velocity", RR),
        ("rr", RR),
        ("left_wheel", 90.0),
        ("rear_wheel", 180.0),
        ("middle_right_speed", -90.0),
        ("vorne_links_rad_s", FL),
    ],
)
def test_a_place_is_the_angle_at_which_it_stands(name, place):
    assert read_name(name).place == place
    assert read_name(name).number is None


@pytest.mark.parametrize(
    "name", ["back_emf_V", "feedback", "wheel_1_left_rad_s", "err", "brake", "curr_A", "front_rear_A", "w1_rad_s"]
)
def test_other_names_say_no_place(name):
    assert read_name(name).place is None


SIX = ("rr", "rl", "fr", "fl")


@pytest.mark.parametrize("form", ["{}_vel_rad_s", "wheel_{}_rad_s", "/{}_wheel_joint/velocity_rad_s", "{}Speed_rad_s"])
def test_four_wheels_are_counted_front_left_front_right_rear_left_rear_right(form):
    names = [form.format(place) for place in SIX]
    assert mapped(*names) == {"w4": names[0], "w3": names[1], "w2": names[2], "w1": names[3]}


def test_a_robot_says_which_wheel_stands_at_a_place():
    robot = load_robot("four-wheel")
    names = [f"{place}_rad_s" for place in SIX]
    found = mapped(*names, robot=robot)
    angle = {"rr": 225.0, "rl": 135.0, "fr": 315.0, "fl": 45.0}
    for key, name in found.items():
        azimuth = robot.wheels.azimuth_deg[int(key[1:]) - 1]
        assert azimuth % 360.0 == angle[name[:2]]
    assert len(found) == 4


def test_mecanum_wheels_are_told_by_their_rollers():
    assert mapped(*(f"{place}_rad_s" for place in SIX), robot=load_robot("mecanum")) == {
        "w1": "fl_rad_s",
        "w2": "fr_rad_s",
        "w3": "rl_rad_s",
        "w4": "rr_rad_s",
    }
    wheels = load_robot("mecanum").wheels
    turned = wheels.replace(azimuth_deg=wheels.azimuth_deg[::-1], roller_angle_deg=wheels.roller_angle_deg[::-1])
    other = load_robot("mecanum").replace(wheels=turned)
    assert mapped(*(f"{place}_rad_s" for place in SIX), robot=other)["w1"] == "rr_rad_s"


def test_three_wheels_stand_next_to_their_places():
    wheels = Wheels(azimuth_deg=(180.0, -60.0, 60.0), robot_radius=0.1, wheel_radius=0.03)
    robot = first_guess("mini", wheels, 3.0)
    names = ("left_wheel_rad_s", "back_wheel_rad_s", "right_wheel_rad_s")
    assert mapped(*names, robot=robot) == {"w1": names[1], "w2": names[2], "w3": names[0]}


def test_places_that_no_wheel_stands_at_are_asked_about():
    wheels = Wheels(azimuth_deg=(0.0, 90.0, 180.0, 270.0), robot_radius=0.1, wheel_radius=0.03)
    found = guess_columns(table("fl_rad_s", "left_rad_s", "rl_rad_s", "right_rad_s"), first_guess("plus", wheels, 3.0))
    assert list(found.columns) == ["t"]
    assert "no number says which wheel each is" in said(found.doubts)[0]


def test_commands_currents_and_voltages_of_places_go_with_their_speeds():
    names = [f"{place}_{what}" for what in ("vel_cmd_rad_s", "current_A", "voltage_V") for place in SIX]
    found = mapped(*names)
    assert {found["w1_cmd"], found["i1"], found["u1"]} == {"fl_vel_cmd_rad_s", "fl_current_A", "fl_voltage_V"}
    assert len(found) == 12


def test_volts_or_speeds_of_places_are_asked_about_and_the_answer_is_taken():
    names = [f"{place}_v" for place in SIX]
    (doubt,) = guess_columns(table(*names)).doubts
    assert "but they may be voltages or speeds: not taken" in said([doubt])[0]
    assert doubt.remedy_text == "say what they are: `assume` v=V or m/s"
    columns = guess_columns(table(*names), assume={"v": "V"}).columns
    assert [columns[f"u{k}"].name for k in (1, 2, 3, 4)] == ["fl_v", "fr_v", "rl_v", "rr_v"]
    columns = guess_columns(table(*names), load_robot("mecanum"), assume={"v": "m/s"}).columns
    assert [columns[f"w{k}"].name for k in (1, 2, 3, 4)] == ["fl_v", "fr_v", "rl_v", "rr_v"]


def test_numbers_come_before_places():
    assert mapped("front_w1_rad_s", "front_w2_rad_s", "rear_w3_rad_s")["w3"] == "rear_w3_rad_s"
