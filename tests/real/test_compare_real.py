"""compare on the real logs: the Robotino through its speed loop, floor by floor; what cannot be compared is refused."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, OmnidynError
from omnidyn.model.robot_file import load_robot

ROBOTINO = load_robot("robotino")
WHEELS = ("w1", "w2", "w3")
# Files of shared/data/README.md: 72 directions each at 0.1, 0.2, 0.3 m/s on gray, 0.1 m/s on green.
FLOORS = {
    "gray_surface": {0.1: range(0, 72, 12), 0.2: range(72, 144, 12), 0.3: range(144, 216, 12)},
    "green_surface": {0.1: range(0, 72, 12)},
}
TURNING = {
    ("gray_surface", 0.1): 0.72,
    ("gray_surface", 0.2): 0.86,
    ("gray_surface", 0.3): 0.90,
    ("green_surface", 0.1): 0.75,
}


def read(data, floor, numbers, **options):
    folder = data / "robotino" / "one_surface_type" / floor
    return [omnidyn.read_log(folder / f"exp{k:02d}.csv", ROBOTINO, **options) for k in numbers]


@pytest.fixture(scope="module")
def found(data):
    """Per floor and speed: six directions of travel, compared with the preset."""
    return {
        (floor, speed): omnidyn.compare(ROBOTINO, read(data, floor, numbers), current_unsigned=True)
        for floor, speeds in FLOORS.items()
        for speed, numbers in speeds.items()
    }


def told(found, floor):
    """What the wheels were told to do, as if they did: rmse per wheel over all runs of a floor."""
    runs = [run for (name, _), each in found.items() if name == floor for run in each.measured]
    error = np.concatenate([run.wheel_speed_command - run.wheel_speed for run in runs])
    return np.sqrt(np.mean(error**2, axis=0))


def rmse(found, floor):
    """The same for the model, pooled over the speeds."""
    parts = [each.overall["robotino"] for (name, _), each in found.items() if name == floor]
    samples = sum(part["w1"].samples for part in parts)
    return np.array([np.sqrt(sum(part[w].rmse ** 2 * part[w].samples for part in parts) / samples) for w in WHEELS])


def test_the_speed_loop_of_the_preset_is_applied_and_said(found):
    for each in found.values():
        assert "set wheel speeds, through the speed loop of the robot file" in each.applied_text("robotino")
        assert {*WHEELS, "i1", "i2", "i3"} <= set(each.channels)


@pytest.mark.parametrize("floor, most", [("gray_surface", 0.40), ("green_surface", 0.25)])
def test_wheel_speeds_are_predicted(found, floor, most):
    """Of wheels turning 2.5 to 7 rad/s: better than what they were told, though green was never fitted."""
    ours, plain = rmse(found, floor), told(found, floor)
    print(f"{floor}: rmse {ours.round(3)} rad/s; taken at their word {plain.round(3)}")
    assert (ours < most).all()
    assert (ours < 0.75 * plain).all()
    for (name, _), each in found.items():
        if name == floor:
            assert min(each.vaf[w] for w in WHEELS) > 80.0


def test_the_model_turns_its_wheels_as_the_robot_does(found):
    """Share of the set speed that is reached, rows 40 to 95 %: the figures of README.md, by the model, within 0.06."""
    for key, share in TURNING.items():
        ratios = []
        for run, ours in zip(found[key].measured, found[key].simulated["robotino"], strict=True):
            rows = slice(int(0.4 * len(run)), int(0.95 * len(run)))
            asked, got = np.abs(run.wheel_speed_command[rows]), np.abs(ours.wheel_speed[rows])
            driven = asked[0] > 1.0
            ratios.append(np.nanmean(got[:, driven], axis=0) / asked[0, driven])
        assert np.concatenate(ratios).mean() == pytest.approx(share, abs=0.06)


def test_the_logs_are_late_and_it_is_seen(found):
    """Set speeds take effect in the log some three rows later: the same lag at every wheel, floor and speed."""
    lags = [each.overall["robotino"][w].lag for each in found.values() for w in WHEELS]
    assert 0.07 < min(lags) <= max(lags) < 0.11


@pytest.mark.parametrize("floor, most", [("gray_surface", 0.20), ("green_surface", 0.19)])
def test_without_the_lag_little_more_than_the_step_of_the_encoder_is_left(data, floor, most):
    """One step is 2.827/16 = 0.177 rad/s at the wheel."""
    numbers = [k for chosen in FLOORS[floor].values() for k in chosen]
    runs = read(data, floor, numbers, latency={"w": 0.088, "i": 0.088})
    each = omnidyn.compare(ROBOTINO, runs, current_unsigned=True)
    assert max(each.rmse[w] for w in WHEELS) < most
    assert max(abs(each.overall["robotino"][w].lag) for w in WHEELS) < 0.02  # rows are 31 ms apart


def test_what_the_model_does_not_know_is_not_white(found):
    """Ripple of the current, a heading that slips away: seen, not hidden."""
    for each in found.values():
        assert all(each.overall["robotino"][i].whiteness < 1e-3 for i in ("i1", "i2", "i3"))


def test_gaps_in_a_run_make_pieces(data):
    """exp200 has three holes of a quarter of a second."""
    run = read(data, "gray_surface", [200])[0]
    each = omnidyn.compare(ROBOTINO, run, current_unsigned=True)
    assert len(each.segments) == 1 + int((np.diff(run.t) > 0.2).sum()) == 4


def test_friction_of_the_preset_is_better_than_none_on_both_floors(data):
    none = ROBOTINO.replace(name="no friction", friction=type(ROBOTINO.friction)())
    for floor, speeds in FLOORS.items():
        each = omnidyn.compare(ROBOTINO, read(data, floor, speeds[0.1]), none, current_unsigned=True)
        assert {each.better(name) for name in (*WHEELS, "i1", "i2", "i3")} == {"robotino"}


def test_a_motor_bench_is_no_robot(data):
    path = data / "odrive_umn" / "demo_data" / "step1.csv"
    run = omnidyn.read_log(path, columns={"t": "timestep (8Hz):0.000125 s"})
    with pytest.raises(
        InputError, match=r"step1.csv: a log of one motor cannot be compared with a robot; .*motor bench"
    ):
        omnidyn.compare(ROBOTINO, run)


def test_set_speeds_without_a_speed_loop_are_refused(data):
    """The other three-wheeled robot, its duties left unread: only set speeds of the body are there."""
    run = omnidyn.read_log(data / "udea_three_omni" / "sensor_data" / "exp1.txt", load_robot("axebot"))
    with pytest.raises(OmnidynError, match="set speeds only, and the robot no speed loop to follow them"):
        omnidyn.compare(load_robot("axebot"), run)
