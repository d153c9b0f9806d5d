"""A robot survives being written and read, to the last bit, whatever its numbers, names and priors."""

from typing import get_args

from hypothesis import given
from hypothesis import strategies as st

from omnidyn.model.robot import Origin, Prior
from omnidyn.model.robot_file import parse_robot, robot_to_toml
from tests.support.strategies import any_robot

NAME = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=40)
KEYS = [
    "body.mass_kg",
    "wheels.wheel_radius_m",
    "motor.gear_ratio",
    "friction.axes.coulomb[1]",
    "wheels.azimuth_deg[0]",
]
ORIGIN = st.sampled_from(get_args(Origin))
PRIOR = st.builds(Prior, std=st.none() | st.floats(1e-12, 1e6), source=NAME | st.just(""), origin=ORIGIN).filter(
    lambda prior: prior.origin != "guess" or prior.std is not None  # one without a std is given one: tests/model
)


@given(any_robot(), NAME, NAME | st.just(""), st.dictionaries(st.sampled_from(KEYS), PRIOR))
def test_text_and_back(robot, name, source, priors):
    robot = robot.replace(name=name, source=source, priors=priors)
    assert parse_robot(robot_to_toml(robot)) == robot


POSITIVE = st.floats(1e-3, 100.0)


@given(any_robot(), st.data())
def test_one_value_per_wheel_and_back(robot, data):
    count = robot.wheels.count

    def each(strategy):
        return tuple(data.draw(st.lists(strategy, min_size=count, max_size=count)))

    changed = robot.replace(
        body=robot.body.replace(rotating_frame=data.draw(st.booleans())),
        wheels=robot.wheels.replace(
            wheel_radius=each(st.floats(1e-3, 1.0)), roller_angle_deg=each(st.floats(-1.0, 1.0))
        ),
        motor=robot.motor.replace(
            resistance=each(POSITIVE),
            inductance=data.draw(POSITIVE),
            current_limit=each(POSITIVE),
            electrical="dynamic",
        ),
    )
    assert parse_robot(robot_to_toml(changed)) == changed


@given(any_robot())
def test_writing_twice_gives_the_same_text(robot):
    text = robot_to_toml(robot)
    assert robot_to_toml(parse_robot(text)) == text
