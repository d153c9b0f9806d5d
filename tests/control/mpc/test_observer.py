"""What the observer of the predictive controller makes of pushes."""

from benchmarks.control_real import errors, makers
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import random_numbers


def test_pushes_on_a_late_robot_with_encoders_do_not_make_it_swing():
    """Its own swinging once looked like knocks without end, and the share of friction went to its limit."""
    numbers = random_numbers(3)
    plant, path = Plant(numbers), paths()["push"]
    made = makers("a drawn robot", numbers, "encoder")
    position = {name: errors(plant, made[name](plant), path, "encoder")[0] for name in ("PID + kS", "mpc")}
    assert position["mpc"] < 1.2 * position["PID + kS"]
