"""The rates of bristles are those of their laws, at the end of a stage too, and their slopes are differences.

The laws are written out here as their sources have them: Dahl 1976; Canudas de Wit et al. 1995; Dupont et al. 2002.
"""

import math

import numpy as np
import pytest

from omnidyn.compiled.kernel import plain
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.friction.bristle import bristle_force, plane_force
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant

SIGMA, SLIDE, HOLD, SPEED = 2e3, (2.6, 1.7), (3.4, 2.0), 0.05
KINDS = {
    "dahl": {"law": "dahl"},
    "dahl 0.6": {"law": "dahl", "dahl_exponent": 0.6},
    "dahl 1.7": {"law": "dahl", "dahl_exponent": 1.7},
    "lugre": {"law": "lugre", "damping": 30.0},
    "lugre that falls": {"law": "lugre", "damping": 30.0, "damping_speed": 0.1, "falls": True},
    "elasto-plastic": {"law": "elastoplastic", "damping": 30.0, "elastic_share": 0.3},
    "elasto-plastic that falls": {"law": "elastoplastic", "damping": 30.0, "elastic_share": 0.3, "falls": True},
}
MUCH = 1e-6  # a step of a speed [m/s], beside speeds of 0.02 m/s


def on_axis(falls=False, **numbers):
    """The record of the x axis."""
    more = {"breakaway": (HOLD[0], *HOLD), "stribeck_speed": (SPEED,) * 3} if falls else {}
    numbers = {name: (value,) * 3 if name.startswith("damping") else value for name, value in numbers.items()}
    law = AxesFriction(viscous=(0.0,) * 3, coulomb=(SLIDE[0], *SLIDE), stiffness=(SIGMA,) * 3, **numbers, **more)
    return plant(load_robot("axebot").replace(friction=Friction(axes=law))).element[0]


def in_plane(falls=False, **numbers):
    """The record of the body, whose friction is along the direction of travel."""
    more = {"breakaway": HOLD, "stribeck_speed": SPEED} if falls else {}
    law = DirectionFriction(coulomb=SLIDE, stiffness=SIGMA, **numbers, **more)
    return plant(load_robot("axebot").replace(friction=Friction(direction=law))).body


def levels(kind, speed):
    """[N] along x and y at a speed along the direction of travel."""
    fallen = math.exp(-((speed / SPEED) ** 2)) if KINDS[kind].get("falls") else 0.0
    return np.array(SLIDE) + (np.array(HOLD) - SLIDE) * fallen


def damping(kind, speed):
    fades = KINDS[kind].get("damping_speed")
    return KINDS[kind].get("damping", 0.0) * (math.exp(-((speed / fades) ** 2)) if fades else 1.0)


def slipping(kind, w):
    """alpha of Dupont et al.: how much of the motion is slip, w: how far a bristle is bent, of its level."""
    share = KINDS[kind]["elastic_share"]
    angle = math.pi * (w - 0.5 * (1.0 + share)) / (1.0 - share)
    return 0.0 if w <= share else 1.0 if w >= 1.0 else 0.5 * (1.0 + math.sin(angle))


def rate(kind, z, v):
    """z' of a bristle bent by z [m] under a speed v [m/s], pairs along x and y."""
    z, v = np.array(z), np.array(v)
    level = levels(kind, np.hypot(*v))
    bend, drive = SIGMA * z / level, np.hypot(*(level * v))
    if kind.startswith("lugre"):
        return v - SIGMA * drive * z / level**2
    if kind.startswith("dahl"):
        left = level * v / drive - bend
        return drive / level * np.hypot(*left) ** (KINDS[kind].get("dahl_exponent", 1.0) - 1.0) * left
    w, along = np.hypot(*bend), float(bend @ (v / level))
    slip = slipping(kind, w) * w * max(along, 0.0) / float(((bend / level) ** 2).sum()) if w else 0.0
    return v - slip * bend / level


def states(count=12):
    """(z*, v, tau): bent by up to their levels, slow and fast; at once, and in short and long stages."""
    rng = np.random.default_rng(3)
    for k in range(count):
        z = rng.uniform(-0.95, 0.95, 2) * SLIDE / np.array(SIGMA) / math.sqrt(2.0)
        yield z, rng.uniform(0.01, 0.2) * rng.choice([-1.0, 1.0], 2), (0.0, 1e-4, 5e-3)[k % 3]


@pytest.mark.parametrize("kind", KINDS)
def test_along_the_direction_of_travel(kind):
    body = in_plane(**KINDS[kind])
    for z, v, tau in states():
        force, slopes, bent = plain(plane_force)(body, *v, tuple(z), tau)
        ends = rate(kind, bent, v)  # an implicit stage: z = z* + tau z'(z)
        assert np.array(bent) == pytest.approx(z + tau * ends, rel=1e-9)
        expected = -SIGMA * np.array(bent) - damping(kind, np.hypot(*v)) * ends
        assert np.array(force) == pytest.approx(expected, rel=1e-9)
        for k, off in enumerate(([MUCH, 0.0], [0.0, MUCH])):
            ends = [plain(plane_force)(body, *(v + sign * np.array(off)), tuple(z), tau)[0] for sign in (1, -1)]
            up, down = np.array(ends)
            assert np.array(slopes)[[k, k + 2]] == pytest.approx((up - down) / (2.0 * MUCH), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_on_an_axis(kind):
    element = on_axis(**KINDS[kind])
    for z, v, tau in states():
        force, slope, bent = plain(bristle_force)(element, v[0], z[0], tau)
        ends = rate(kind, [bent, 0.0], [v[0], 0.0])[0]
        assert bent == pytest.approx(z[0] + tau * ends, rel=1e-9)
        assert force == pytest.approx(-SIGMA * bent - damping(kind, abs(v[0])) * ends, rel=1e-9)
        up, down = (plain(bristle_force)(element, v[0] + off, z[0], tau)[0] for off in (MUCH, -MUCH))
        assert slope == pytest.approx((up - down) / (2.0 * MUCH), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_what_does_not_move_bends_no_further(kind):
    bent = (0.3e-3, -0.2e-3)
    force, _, after = plain(plane_force)(in_plane(**KINDS[kind]), 0.0, 0.0, bent, 1e-3)
    assert after == bent
    assert force == pytest.approx((-SIGMA * bent[0], -SIGMA * bent[1]), rel=1e-12)


def test_what_is_held_on_one_axis_gives_way_on_another():
    """Without a division by the sign of what is 0."""
    law = AxesFriction(viscous=(1.0,) * 3, coulomb=(2.0, 2.0, 0.1), breakaway=(3.0, 3.0, 0.2))
    assert law.wrench(np.zeros(3), [0.0, -3.5, 0.15]) == pytest.approx([0.0, 2.0, -0.15])
