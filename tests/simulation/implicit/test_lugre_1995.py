"""LuGre with the numbers of Canudas de Wit, Olsson, Astrom & Lischinsky (1995): its loop before it slips, and at which
speeds it gives energy back."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from omnidyn.model.friction import AxesFriction, Friction, lugre
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import start_state
from omnidyn.simulation.implicit.implicit_march import run_implicit
from omnidyn.simulation.speed_loop import no_loop
from tests.reference.modes_plant import plant_of

SIGMA_0, SIGMA_1, SIGMA_2, COULOMB, BREAKAWAY, STRIBECK = 1e5, math.sqrt(1e5), 0.4, 1.0, 1.5, 1e-3
AXEBOT = load_robot("axebot")
LEVELS = AxesFriction(
    viscous=(SIGMA_2, SIGMA_2, 0.01),
    coulomb=(COULOMB, COULOMB, 0.1),
    breakaway=(BREAKAWAY, BREAKAWAY, 0.15),
    law="lugre",
    stribeck_speed=(STRIBECK, STRIBECK, 1e-2),
    stiffness=(SIGMA_0, SIGMA_0, 1e3),
    damping=(SIGMA_1, SIGMA_1, 3.0),
)
ROBOT = AXEBOT.replace(body=AXEBOT.body.replace(mass=1.0), friction=Friction(axes=LEVELS))
VOLT = 1.0 / (math.sqrt(3.0) * 0.0059 * 19.0 / 0.035 / 1.69)  # of each of two motors, for a force of 1 N
MOST, RATE, ROWS = (
    1.425,
    0.1,
    2000,
)  # [N], 95 % of breakaway; [N/s]; rows from 0 to it: long steps shake it


def test_its_loop_before_it_slips():
    """The force goes to 95 % of breakaway, back to as much the other way, and there again, as in fig. 2: against its
    differential equation, and, so slow, against the exponentials of Dahl with the level of breakaway."""
    there, whole = np.arange(1, ROWS + 1) / ROWS, np.arange(1, 2 * ROWS + 1) / ROWS
    force = MOST * np.concatenate([there, 1.0 - whole, whole - 1.0])
    step = MOST / RATE / ROWS
    middle = force - 0.5 * np.diff(force, prepend=0.0)
    numbers = plant(ROBOT)
    out = run_implicit(
        numbers,
        np.outer(middle * VOLT, [0.0, 1.0, -1.0]),
        np.full((len(force), 3), np.inf),
        np.full(len(force), step),
        start_state(numbers, np.zeros(3), np.zeros(3)),
        np.zeros(3),
        no_loop(3),
        1e-6,
    )
    way = out.pose[1:, 0]
    p, t = plant_of(ROBOT.rigid), np.arange(1, len(force) + 1) * step
    corners, forces = np.array([0.0, 1.0, 3.0, 5.0]) * MOST / RATE, np.array([0.0, 1.0, -1.0, 1.0]) * MOST
    braking = float(p.K[1] * p.E[1] / p.R[1] * (p.G[0] @ p.G[0])) + SIGMA_2

    def rates(time, state):
        _, v, z = state
        bent = v - SIGMA_0 * abs(v) * z / (COULOMB + (BREAKAWAY - COULOMB) * math.exp(-((v / STRIBECK) ** 2)))
        pull = float(np.interp(time, corners, forces))
        return [v, pull - braking * v - SIGMA_0 * z - SIGMA_1 * bent, bent]

    exact = solve_ivp(rates, (0.0, t[-1]), [0.0] * 3, "LSODA", t_eval=t, rtol=1e-8, atol=1e-13, max_step=10 * step)
    size = float(np.ptp(exact.y[0]))
    assert np.abs(way - exact.y[0]).max() < 5e-4 * size
    # sigma0 x = -Fs ln(1 - F/Fs) on the first way there; Fs - (Fs + F0) e^(-sigma0 |x - x0|/Fs) on the others.
    bend = BREAKAWAY / SIGMA_0
    assert way[ROWS - 1] == pytest.approx(-bend * math.log(1.0 - MOST / BREAKAWAY), rel=0.01)
    span = -bend * math.log(1.0 - 2.0 * MOST / (BREAKAWAY + MOST))
    assert way[ROWS - 1] - way[3 * ROWS - 1] == pytest.approx(span, rel=0.01)
    # Every way after the first is as long: the loop closes, and holds an area, which is the energy lost.
    assert abs(way[5 * ROWS - 1] - way[ROWS - 1]) < 0.01 * size
    loop = slice(ROWS - 1, 5 * ROWS)
    lost = float(np.trapezoid(force[loop], way[loop]))
    assert lost == pytest.approx(2.0 * (BREAKAWAY * span - 2.0 * MOST * bend), rel=0.01)


@pytest.mark.parametrize("speed", [0.005, 0.02, 0.05])
def test_where_it_gives_energy_back(speed):
    """The known exception: bent by slow motion and then fast, the damping of a bristle that straightens pushes along.

    Power that is neither stored nor lost: v (y^2/g + sigma1 v (1 - y/g)), y = sigma0 z; below 0 from v = y^2/(sigma1
    (y - g)) on. A damping that fades with the speed gives nothing back (Olsson, Control Systems with Friction, 1996).
    """
    bent, level = BREAKAWAY / SIGMA_0, COULOMB  # on a slow way; the level at a speed far above that of Stribeck
    own = SimpleNamespace(stiffness=SIGMA_0)
    rate = lugre.rate.py_func(own, bent, speed, 0.0, level, 0.0)[0]

    def lost(damping):
        force = SIGMA_0 * bent + damping * rate
        return force * speed - SIGMA_0 * bent * rate

    by_hand = speed * (BREAKAWAY**2 / level + SIGMA_1 * speed * (1.0 - BREAKAWAY / level))
    assert lost(SIGMA_1) == pytest.approx(by_hand, rel=1e-12)
    gives = speed > BREAKAWAY**2 / (SIGMA_1 * (BREAKAWAY - level))
    assert (lost(SIGMA_1) < 0.0) == gives
    assert gives == (speed > 0.0142)
    assert lost(SIGMA_1 * math.exp(-((speed / STRIBECK) ** 2))) > 0.0
