"""Where the electric energy goes: terminal power = heat + drop + gear + friction + what is stored, to 10 tol.

Every term is put down anew from the channels of the run and the law, block by block of held voltage, and integrated by
Simpson's rule on samples so fine that its own error is below the bound. Where a current with inductance reaches its
limit, the driver's voltage jumps: one sample's length of that jump is allowed, each time.
"""

import numpy as np
import pytest

from omnidyn.simulation.simulate import simulate
from tests.support.friction_shapes import SHAPES, shaped

TOL = 1e-6
MOTORS = {
    "plain": {},
    "drop, gear, limit": {
        "voltage_drop": (0.3, 0.2, 0.25),
        "gear_efficiency": (0.8, 0.9, 0.75),
        "current_limit": 1.4,
        "resistance": (1.69, 1.6, 1.8),
    },
    "unequal rotors": {"rotor_inertia": (4e-7, 9e-7, 2e-7)},
    "dynamic": {"electrical": "dynamic", "inductance": 4e-3},
    "dynamic, drop, gear, limit": {
        "electrical": "dynamic",
        "inductance": (4e-3, 3e-3, 5e-3),
        "voltage_drop": 0.3,
        "gear_efficiency": 0.8,
        "current_limit": (1.4, 1.2, 1.6),
    },
}


def currents(robot, twist, voltage):
    """Settled currents (samples, wheels): clip(soft(u - E s, V_d)/R)."""
    m = robot.motor
    emf = m.gear_ratio * m.emf_constant / robot.wheels.wheel_radius
    push = voltage - emf * (twist @ robot.wheels.wrench_matrix)
    i = np.sign(push) * np.maximum(np.abs(push) - m.voltage_drop, 0.0) / m.resistance
    return i if m.current_limit is None else np.clip(i, -np.array(m.current_limit), m.current_limit)


def powers(robot, twist, current, voltage):
    """(terminal, lost) power [W] of samples in one block of held voltage."""
    m, f = robot.motor, robot.friction
    rim = twist @ robot.wheels.wrench_matrix
    at_rim = m.gear_ratio / robot.wheels.wheel_radius
    terminal = np.broadcast_to(voltage, current.shape)
    if m.current_limit is not None:  # at the limit the driver lowers the voltage until L di/dt = 0
        balance = m.resistance * current + at_rim * m.emf_constant * rim + m.voltage_drop * np.sign(current)
        limited = np.abs(current) >= np.array(m.current_limit) * (1 - 1e-12)
        outward = (voltage - balance) * np.sign(current) > 0.0
        terminal = np.where(limited & outward, balance, terminal)
    shaft, eta = at_rim * m.torque_constant * current * rim, np.array(m.gear_efficiency)
    gear = np.where(shaft > 0.0, (1.0 - eta) * shaft, (1.0 / eta - 1.0) * -shaft)
    wheels = f.wheels.coulomb * np.maximum(rim, 0.0) + f.wheels.backward * np.maximum(-rim, 0.0)
    lost = np.array(m.resistance) * current**2 + m.voltage_drop * np.abs(current) + gear + wheels
    lost = (lost + f.wheels.viscous * rim**2).sum(axis=1)
    lost += np.abs(twist) @ f.axes.coulomb + twist**2 @ f.axes.viscous
    lost += np.hypot(*(np.array(f.direction.coulomb) * twist[:, :2]).T)
    lost += f.direction.viscous * (twist[:, :2] ** 2).sum(axis=1)
    lost += f.direction.yaw_coulomb * np.abs(twist[:, 2]) + f.direction.yaw_viscous * twist[:, 2] ** 2
    return (terminal * current).sum(axis=1), lost


def simpson(values, h):
    return h / 3.0 * (values[0] + values[-1] + 4.0 * values[1:-1:2].sum() + 2.0 * values[2:-1:2].sum())


def missing(robot, levels, block, rows, tol):
    """(energy put in less energy lost and stored, what jumps of the voltage may hide) at the end of each block [J]."""
    h = block / rows
    run = simulate(robot, np.repeat(levels, rows, axis=0), h, tol=tol)
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    spin = np.array(robot.motor.rotor_inertia) * robot.motor.gear_ratio**2 + robot.wheels.wheel_inertia
    stored = (0.5 * mass * run.twist**2).sum(axis=1) + (0.5 * spin * run.wheel_speed**2).sum(axis=1)
    dynamic = robot.motor.electrical == "dynamic"
    if dynamic:
        stored = stored + (0.5 * np.array(robot.motor.inductance) * run.current**2).sum(axis=1)
    gone, hidden, out = 0.0, 0.0, []
    for k, level in enumerate(levels):
        part = slice(k * rows, (k + 1) * rows + 1)
        i = run.current[part] if dynamic else currents(robot, run.twist[part], level)
        terminal, lost = powers(robot, run.twist[part], i, level)
        gone += simpson(terminal - lost, h)
        if dynamic and robot.motor.current_limit is not None:
            jumps = np.abs(np.diff(terminal))
            hidden += h * jumps[jumps > 0.1].sum()
        out.append((gone - stored[(k + 1) * rows], hidden))
    return np.array(out).T


@pytest.mark.parametrize("motor", MOTORS)
@pytest.mark.parametrize("shape", [s for s in SHAPES if s not in ("disc", "wheels, breakaway")])
@pytest.mark.some(11)
def test_the_energy_balance_closes(shape, motor):
    """Ten random levels of 40 ms with reversals, stops and rests: closed to 10 tol [J] after every one of them."""
    robot = shaped(shape, **MOTORS[motor])
    random = np.random.default_rng(7)
    levels = np.round(random.uniform(-6.0, 6.0, (10, 3)), 2)
    levels[3], levels[4], levels[8] = 0.0, 0.0, -levels[7]
    left, hidden = missing(robot, levels, 0.04, 1600, TOL)
    assert (np.abs(left) <= 10 * TOL + hidden).all()
    assert hidden[-1] <= 3e-3


def test_a_wrong_term_would_be_seen():
    """The bound is sharp: 0.1 % more resistance in the books breaks it a hundred times over."""
    robot = shaped("ellipse")
    levels = np.array([[4.0, -3.0, 2.0], [-4.0, 3.0, 1.0]])
    heavier = robot.replace(motor=robot.motor.replace(resistance=1.69 * 1.001))
    h, rows = 0.04 / 800, 800
    run = simulate(robot, np.repeat(levels, rows, axis=0), h, tol=TOL)
    i = currents(robot, run.twist[: rows + 1], levels[0])
    wrong = [simpson(powers(r, run.twist[: rows + 1], i, levels[0])[1], h) for r in (robot, heavier)]
    assert abs(wrong[1] - wrong[0]) > 100 * TOL
    assert np.abs(missing(robot, levels, 0.04, rows, TOL)[0]).max() <= 10 * TOL
