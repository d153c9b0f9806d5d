"""Bristles take energy along any driven motion, and where one gives some back it is known why.

A storage function says so: W = sigma0 |z|^2/2 is convex, so over a stage that ends at z, z' tau from where it began,

    F . v tau - (W_end - W_begin) >= tau (sigma0 z . (v - z') + sigma1 z' . v),

and both terms of the law are >= 0. z . (v - z') is, wherever z is: Dahl's in the plane, d = n - Z, comes to
1 + |d|^(a+1) - n . d (1 + |d|^(a-1)) >= (1 - |d|)(1 - |d|^a) >= 0, and what slips of an elasto-plastic bristle does so
along the normal of its ellipse. z' . v is as long as no bristle is bent beyond its level. With a level that falls one
is, when it speeds up: there a constant sigma1 gives energy back (LuGre: Olsson 1996).
"""

import math

import numpy as np
import pytest

from omnidyn.compiled.kernel import plain
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.friction.bristle import LAWS, bristle_force
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant

STIFFNESS, DAMPING = 1e4, 80.0
AXEBOT = load_robot("axebot")
NEW = {
    "dahl 0.6": {"law": "dahl", "dahl_exponent": 0.6},
    "dahl": {"law": "dahl"},
    "dahl 1.7": {"law": "dahl", "dahl_exponent": 1.7},
    "dahl 3": {"law": "dahl", "dahl_exponent": 3.0},
    **{f"elastic {b}": {"law": "elastoplastic", "elastic_share": b} for b in (0.0, 0.3, 0.7, 0.95)},
}
FALLS = {"breakaway": (2.8, 2.8, 0.2), "stribeck_speed": (0.02, 0.02, 0.2)}


def motion(rows, seed):
    """(speeds (rows, 2) that wander, turn, reverse and jump over three decades, lengths of the steps)."""
    rng = np.random.default_rng(seed)
    size = np.repeat(10.0 ** rng.uniform(-3.5, -0.5, rows // 50 + 1), 50)[:rows]
    angle = np.cumsum(0.3 * rng.normal(size=rows)) + np.repeat(rng.uniform(0.0, 6.3, rows // 200 + 1), 200)[:rows]
    swing = np.sin(np.cumsum(0.2 * rng.uniform(0.0, 1.0, rows)))
    speeds = (size * swing)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return speeds, 10.0 ** rng.uniform(-5.0, -2.5, rows)


def taken(force, speed, tau, before, after):
    """(energy taken beside what is stored, the size of its terms) of a step [J]."""
    given, stored = tau * np.dot(force, speed), 0.5 * STIFFNESS * (np.dot(after, after) - np.dot(before, before))
    return given - stored, abs(given) + abs(stored)


@pytest.mark.parametrize("coulomb", [(2.0, 2.0), (2.6, 1.1)], ids=["disc", "ellipse"])
@pytest.mark.parametrize("name", NEW)
def test_along_the_direction_of_travel_they_take_energy_in_every_step(name, coulomb):
    """The bristle of the ellipse, whose speed turns against it as the body turns. Damping, where a law has it, too."""
    own = {"damping": DAMPING} if NEW[name]["law"] == "elastoplastic" else {}
    way = DirectionFriction(coulomb=coulomb, stiffness=STIFFNESS, **NEW[name], **own)
    body = plant(AXEBOT.replace(friction=Friction(direction=way))).body
    z, total = np.zeros(2), 0.0
    for speed, tau in zip(*motion(1500, 4), strict=True):
        levels = (*coulomb, 0.0, 0.0, math.hypot(*speed))
        rate = np.array(LAWS[int(body.law)].plane(body, tuple(z), tuple(speed), tau, levels)[:2])
        before, z = z, z + tau * rate
        more, size = taken(STIFFNESS * z + body.damping * rate, speed, tau, before, z)
        assert more >= -1e-13 * size
        assert not own or np.hypot(*(STIFFNESS * z / coulomb)) <= 1.0 + 1e-9
        total += more
    assert total > 0.0


def along_axis(speeds, lengths, **numbers):
    """(the energy taken in each step, the size of its terms) of the x axis [J]."""
    law = AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(2.0, 2.0, 0.1), stiffness=(STIFFNESS,) * 3, **numbers)
    element, z, found = plant(AXEBOT.replace(friction=Friction(axes=law))).element[0], 0.0, []
    for speed, tau in zip(speeds, lengths, strict=True):
        force, _, bent = plain(bristle_force)(element, speed, z, tau)
        found.append(taken([-force], [speed], tau, [z], [bent]))
        z = bent
    return np.array(found).T


@pytest.mark.parametrize("name", NEW)
def test_on_an_axis_they_take_energy_in_every_step(name):
    own = {"damping": (DAMPING,) * 3} if NEW[name]["law"] == "elastoplastic" else {}
    speeds, lengths = motion(1500, 7)
    more, size = along_axis(speeds[:, 0], lengths, **NEW[name], **own)
    assert (more >= -1e-13 * size).all()
    assert more.sum() > 0.0


@pytest.mark.parametrize("law", ["lugre", "elastoplastic"])
def test_a_level_that_falls_under_a_constant_damping_gives_energy_back_where_it_speeds_up(law):
    """The exception of LuGre, which elasto-plastic bristles share: bent to S by a slow slide, w = S/C at 0.2 m/s, where
    g w^2 + sigma1 |v| (1 - w) < 0. Without damping, or with one that fades, none does, there and along any motion."""
    jump = np.repeat([0.002, 0.2], [300, 20]), np.repeat([1e-3, 1e-6], [300, 20])
    speeds, lengths = motion(1500, 7)
    more, size = along_axis(*jump, law=law, damping=(600.0,) * 3, **FALLS)
    assert (more[300:] < -0.5 * size[300:]).any()
    for own in ({"damping": (0.0,) * 3}, {"damping": (600.0,) * 3, "damping_speed": (0.02,) * 3}):
        for way in (jump, (speeds[:, 0], lengths)):
            more, size = along_axis(*way, law=law, **own, **FALLS)
            assert (more >= -1e-13 * size).all()
