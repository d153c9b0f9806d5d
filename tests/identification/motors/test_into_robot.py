"""Numbers of a robot file from logs of its motors, against logs made by small steps of eqs (10) (11) themselves."""

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorFit, MotorLine
from omnidyn.identification.motors.into_robot import motors_into_robot
from omnidyn.model.motor import mass_at_rim
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.run import Run
from tests.support.codes import codes

EMF, TORQUE, COULOMB = "motor.emf_constant_Vs_rad", "motor.torque_constant_Nm_A", "friction.wheels.coulomb"
VISCOUS, ROTOR = "friction.wheels.viscous", "motor.rotor_inertia_kg_m2"
DT, FINE, ROWS = 0.01, 20, 800
GEAR, RADIUS, RESISTANCE = 16.0, 0.04, 5.95  # of the preset robotino
TRUE = ((0.050, 3.0), (0.052, 4.0), (0.048, 2.0))  # K_v = K_t [V s/rad], c [N] of each motor
INERTIA = 4e-4  # at the wheel [kg m^2]


def wheel(voltage, constant, coulomb, viscous=0.0, drop=0.0, inertia=INERTIA):
    """J w' = l K i - r (b r w + c sgn w), R i = u - K l w less the drop, stick at 0: (speed, current) at the rows."""
    w, found = 0.0, []
    for u in voltage:
        rows = []
        for _ in range(FINE):
            push = u - constant * GEAR * w
            i = np.sign(push) * max(abs(push) - drop, 0.0) / RESISTANCE
            rows.append((w, i))
            torque = GEAR * constant * i - RADIUS**2 * viscous * w
            if w == 0.0 and abs(torque) <= RADIUS * coulomb:
                continue
            side = np.sign(w) or np.sign(torque)
            new = w + DT / FINE / inertia * (torque - RADIUS * coulomb * side)
            w = new if new * side > 0.0 else 0.0
        found.append(rows[0])
    return np.array(found).T


def log(kind="voltage", seed=0, motors=TRUE, noise=0.02, hold=40, **how):
    """A run of the motors, the wheels off the ground: steps of voltage between 3 and 9 V, either way."""
    rng = np.random.default_rng(seed)
    shape = ROWS // hold, len(motors)
    voltage = np.repeat(rng.uniform(3.0, 9.0, shape) * rng.choice([-1.0, 1.0], shape), hold, axis=0)
    speed, current = np.stack([wheel(u, *own, **how) for u, own in zip(voltage.T, motors, strict=True)], axis=-1)
    put_in = {"duty": {"duty": voltage / 12.0}, "current": {"current": current, "voltage": voltage}}
    return Run(
        t=DT * np.arange(ROWS),
        **put_in.get(kind, {kind: voltage}),
        wheel_speed=speed + noise * rng.standard_normal(speed.shape),
        supply=np.full(ROWS, 12.0) if kind == "duty" else None,
        source="bench.csv",
    )


def tied():
    """robotino, whose K_t and K_v are one number."""
    return load_robot("robotino")


@pytest.mark.parametrize("method", [MotorLine(), MotorFit(between="hold", nuisances="none")])
@pytest.mark.some(1)
def test_the_numbers_come_back(method):
    """Within four standard errors, and what steps of 0.5 ms are off by."""
    numbers = motors_into_robot(identify([log()], None, method).study, tied())
    for m, (constant, coulomb) in enumerate(TRUE):
        for key, true in ((EMF, constant), (TORQUE, constant), (COULOMB, coulomb)):
            own = f"{key}[{m}]"
            assert abs(numbers.value[own] - true) < 4.0 * numbers.std[own] + 0.02 * true
            assert numbers.std[own] < 0.1 * true
    if isinstance(method, MotorFit):
        assert len(numbers.value) == 12
    else:  # 3.7 ms, with rows every 10 ms
        assert len(numbers.value) == 9
        assert "lag_too_short" in codes(numbers.remarks)


HEAVY = 4e-3  # at the wheel [kg m^2]: a lag of 37 ms


@pytest.mark.parametrize("method", [MotorLine(), MotorFit(between="hold", nuisances="none")])
@pytest.mark.some(1)
def test_a_rotor_comes_back(method):
    """Within four standard errors, and what steps of 0.5 ms are off by."""
    numbers = motors_into_robot(identify([log(inertia=HEAVY)], None, method).study, tied())
    for m in range(3):
        rotor, true = f"{ROTOR}[{m}]", HEAVY / GEAR**2
        assert abs(numbers.value[rotor] - true) < 4.0 * numbers.std[rotor] + 0.02 * true
        assert numbers.std[rotor] < 0.1 * true
    assert "rotor_holds_wheel" in codes(numbers.remarks)


def test_the_rotor_is_what_the_wheel_leaves():
    """In the file as in the mass matrix: J l^2 + J_w is what was measured."""
    study, robot = identify([log(inertia=HEAVY)], None, MotorLine()).study, tied()
    bare = motors_into_robot(study, robot)
    heavy = motors_into_robot(study, robot.replace(wheels=robot.wheels.replace(wheel_inertia=1e-4)))
    for m in range(3):
        key = f"{ROTOR}[{m}]"
        assert heavy.value[key] * GEAR**2 + 1e-4 == pytest.approx(bare.value[key] * GEAR**2)
        assert mass_at_rim(heavy.robot.motor, heavy.robot.wheels)[m] == pytest.approx(
            mass_at_rim(bare.robot.motor, bare.robot.wheels)[m]
        )
    assert "rotor_holds_wheel" not in codes(heavy.remarks)
    all_wheel = motors_into_robot(study, robot.replace(wheels=robot.wheels.replace(wheel_inertia=1e-1)))
    assert not [key for key in all_wheel.value if key.startswith(ROTOR)]
    assert "wheel_explains_inertia" in codes(all_wheel.remarks)


def test_steady_windows_give_no_inertia_and_say_so():
    numbers = motors_into_robot(identify([log(hold=100)], None, MotorLine(window=(0.5, 1.0))).study, tied())
    assert not [key for key in numbers.value if key.startswith(ROTOR)]
    assert ROTOR in [remark.subject for remark in numbers.remarks]


def test_they_stand_in_the_file_with_std_and_source():
    study = identify([log()], None, MotorLine()).study
    numbers = motors_into_robot(study, tied())
    robot = parse_robot(robot_to_toml(numbers.robot))
    for key, number in numbers.value.items():
        name, index = key[:-3], int(key[-2])
        table = robot.friction.wheels if name == COULOMB else robot.motor
        field = {EMF: "emf_constant", TORQUE: "torque_constant", COULOMB: "coulomb", ROTOR: "rotor_inertia"}[name]
        assert getattr(table, field)[index] == number
        assert robot.priors[key].std == pytest.approx(numbers.std[key])
        assert "bench.csv" in robot.priors[key].source
    assert robot.motor.resistance == tied().motor.resistance


def test_a_voltage_drop_and_viscous_friction_of_the_file_count():
    robot = tied()
    robot = robot.replace(
        motor=robot.motor.replace(voltage_drop=0.3),
        friction=robot.friction.replace(wheels=robot.friction.wheels.replace(viscous=10.0)),
    )
    numbers = motors_into_robot(identify([log(viscous=10.0, drop=0.3)], None, MotorLine()).study, robot)
    for m, (constant, coulomb) in enumerate(TRUE):
        for key, true in ((f"{EMF}[{m}]", constant), (f"{COULOMB}[{m}]", coulomb)):
            assert abs(numbers.value[key] - true) < 4.0 * numbers.std[key] + 0.02 * true


def test_a_torque_constant_of_its_own_stays():
    robot = tied().replace(motor=tied().motor.replace(torque_constant=0.04))
    numbers = motors_into_robot(identify([log()], None, MotorLine()).study, robot)
    assert not [key for key in numbers.value if key.startswith(TORQUE)]
    assert numbers.robot.motor.torque_constant == 0.04
    band = identify([log()], None, MotorLine()).motors[0].value["dead_band"]
    assert numbers.value[f"{COULOMB}[0]"] == pytest.approx(GEAR * 0.04 / (RESISTANCE * RADIUS) * band)


def test_a_duty_is_taken_times_its_supply():
    volts, duty = (
        motors_into_robot(identify([log(kind)], None, MotorLine()).study, tied()) for kind in ("voltage", "duty")
    )
    for key, number in volts.value.items():
        assert duty.value[key] == pytest.approx(number, rel=1e-6)
        assert duty.std[key] == pytest.approx(volts.std[key], rel=1e-3)
    study = identify([log("duty").replace(supply=None)], None, MotorLine()).study
    assert motors_into_robot(study, tied()).value == {}
    nominal = tied().replace(drive=tied().drive.replace(supply=12.0))
    assert motors_into_robot(study, nominal).value == pytest.approx(duty.value)


def test_a_current_gives_friction_alone():
    """From steady windows, by the torque constant of the file."""
    robot = tied().replace(motor=tied().motor.replace(torque_constant=0.05))
    run = log("current", motors=((0.05, 3.0),) * 3, viscous=10.0, noise=0.0, hold=100)
    numbers = motors_into_robot(identify([run], None, MotorLine(input="current", window=(0.5, 1.0))).study, robot)
    for m in range(3):
        assert numbers.value[f"{COULOMB}[{m}]"] == pytest.approx(3.0, rel=0.05)
        assert numbers.value[f"{VISCOUS}[{m}]"] == pytest.approx(10.0, rel=0.15)
    assert not [key for key in numbers.value if key.startswith("motor.")]


def test_what_is_not_determined_is_not_written_and_said():
    free = motors_into_robot(identify([log(motors=((0.05, 0.0),) * 3)], None, MotorLine()).study, tied())
    assert not [key for key in free.value if key.startswith(COULOMB)]
    assert "no_dead_band" in [remark.numbers.get("why") for remark in free.remarks]
    one = log().replace(voltage=np.full((ROWS, 3), 6.0), wheel_speed=np.full((ROWS, 3), 7.0))
    with pytest.raises(InsufficientDataError, match="a line needs several speeds; got 7 rad/s in every window"):
        identify([one], None, MotorLine())


def test_motors_that_were_not_logged_keep_their_numbers():
    numbers = motors_into_robot(identify([log(motors=TRUE[:1])], None, MotorLine()).study, tied())
    assert numbers.robot.motor.emf_constant[1:] == (0.0514, 0.0514)
    assert numbers.robot.motor.emf_constant[0] == numbers.value[f"{EMF}[0]"]
    with pytest.raises(InputError, match="more motors than the robot has wheels; got 4; expected 3 or fewer"):
        motors_into_robot(identify([log(motors=(*TRUE, TRUE[0]))], None, MotorLine()).study, tied())


def test_levels_of_breakaway_go_along():
    robot = tied()
    wheels = robot.friction.wheels.replace(coulomb=1.0, coulomb_backward=1.2, breakaway=1.5, breakaway_backward=9.0)
    robot = robot.replace(friction=robot.friction.replace(wheels=wheels))
    numbers = motors_into_robot(identify([log()], None, MotorLine()).study, robot)
    again = parse_robot(robot_to_toml(numbers.robot)).friction.wheels
    assert again.breakaway == again.coulomb_backward == again.coulomb
    assert again.breakaway_backward == (9.0, 9.0, 9.0)
