"""The levels of friction tables, and the numbers of a plant made of them, by the units that layout.py states.

Yaw is measured as length, rho = sqrt(I/M): a torque T counts as T/rho [N], B [N m s] as B/rho^2, sigma0 [N m/rad] as
sigma0/rho^2, a speed as rho omega.
"""

import math

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.friction.kinds import KINDS, words_of
from omnidyn.model.robot_file import load_robot
from omnidyn.model.stick_slip.plant import plant

AXEBOT = load_robot("axebot")
MASS, INERTIA = AXEBOT.body.mass, AXEBOT.body.inertia
RHO = math.sqrt(INERTIA / MASS)
NONE = (0.0, 0.0, 0.0)
C, S, CB, SB = (2.0, 1.5, 0.1), (3.0, 1.75, 0.15), (2.5, 1.0, 0.05), (2.75, 4.0, 0.05)


def of(**parts):
    return plant(AXEBOT.replace(friction=Friction(**parts)))


# ---- forward and backward ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "given, backward, hold_backward",
    [
        ({}, C, C),
        ({"breakaway": S}, C, S),
        ({"coulomb_backward": CB}, CB, CB),
        ({"breakaway": S, "coulomb_backward": CB}, CB, CB),
        ({"breakaway_backward": S}, C, S),
        ({"breakaway": S, "coulomb_backward": CB, "breakaway_backward": SB}, CB, SB),
    ],
)
def test_a_level_that_is_left_out_is_that_of_the_other_side(given, backward, hold_backward):
    """docs/robot-file.md: absent, C backward is C; S backward is C backward where that is given, or else S."""
    axes = AxesFriction(viscous=NONE, coulomb=C, **given)
    assert (axes.backward, axes.hold_backward) == (backward, hold_backward)
    wheels = WheelFriction(coulomb=C, **given)
    forward = given.get("breakaway", C)
    assert (wheels.backward, wheels.hold_forward, wheels.hold_backward) == (backward, forward, hold_backward)
    element = of(axes=axes, wheels=wheels).element
    units = np.array([[1.0], [1.0], [RHO]])
    np.testing.assert_allclose(element["coulomb"][:3], np.stack([C, backward], 1) / units, rtol=1e-15)
    np.testing.assert_allclose(element["breakaway"][:3], np.stack([forward, hold_backward], 1) / units, rtol=1e-15)
    np.testing.assert_array_equal(element["coulomb"][3:], np.stack([C, backward], 1))
    np.testing.assert_array_equal(element["breakaway"][3:], np.stack([forward, hold_backward], 1))


@pytest.mark.parametrize("lower", [0, 1, 2])
def test_no_level_at_rest_is_below_that_of_motion_and_one_may_be_as_large(lower):
    below = tuple(0.9 * c if k == lower else c for k, c in enumerate(C))
    for table, more in ((AxesFriction, {"viscous": NONE}), (WheelFriction, {})):
        for key, words in (("breakaway", "breakaway"), ("breakaway_backward", "breakaway_backward")):
            assert getattr(table(coulomb=C, **more, **{key: C}), key) == C
            with pytest.raises(InputError, match=rf"{words} .* is below coulomb"):
                table(coulomb=C, **more, **{key: below})
        with pytest.raises(InputError, match=r"breakaway_backward .* is below coulomb"):
            table(coulomb=below, coulomb_backward=C, breakaway_backward=below, **more)
    assert DirectionFriction(coulomb=C[:2], breakaway=C[:2]).breakaway == C[:2]
    assert DirectionFriction(yaw_coulomb=0.1, yaw_breakaway=0.1).yaw_breakaway == 0.1
    with pytest.raises(InputError, match=r"breakaway \[.*\] is below coulomb"):
        DirectionFriction(coulomb=C[:2], breakaway=(1.9, 1.6) if lower != 1 else (2.1, 1.4))
    with pytest.raises(InputError, match=r"yaw_breakaway 0\.09 is below yaw_coulomb 0\.1"):
        DirectionFriction(yaw_coulomb=0.1, yaw_breakaway=0.09)


def test_one_number_serves_all_wheels():
    law = WheelFriction(coulomb=0.5, breakaway=(0.5, 0.75, 1.0))
    assert law.hold_backward == (0.5, 0.75, 1.0)
    np.testing.assert_array_equal(of(wheels=law).element["breakaway"][3:, 0], [0.5, 0.75, 1.0])
    with pytest.raises(InputError, match=r"breakaway .* is below coulomb"):
        WheelFriction(coulomb=0.8, breakaway=(0.9, 0.7, 1.0))
    with pytest.raises(InputError, match=r"breakaway .* is below coulomb"):
        WheelFriction(coulomb=(0.5, 0.5, 0.8), breakaway=0.75)


def test_an_ellipse_has_two_levels_or_none():
    for flat in ((1.0, 0.0), (0.0, 1.0)):
        with pytest.raises(InputError, match="is flat; give both entries"):
            DirectionFriction(coulomb=flat)


# ---- friction along the direction of travel -----------------------------------------------------------------


def test_what_an_ellipse_at_rest_takes_of_a_wrench():
    """(Fx/Sx)^2 + (Fy/Sy)^2 <= 1 and |T| <= S_yaw; by C where no S is given."""
    plain = DirectionFriction(coulomb=(4.0, 2.0), yaw_coulomb=0.5)
    assert plain.held_share(np.array([2.0, 0.0, 0.0])) == pytest.approx(0.5)
    assert plain.held_share(np.array([0.0, -2.0, 0.1])) == pytest.approx(1.0)
    assert plain.held_share(np.array([2.4, -1.6, 0.1])) == pytest.approx(1.0)
    assert plain.held_share(np.array([2.4, -1.6, -0.75])) == pytest.approx(1.5)
    firm = DirectionFriction(coulomb=(4.0, 2.0), breakaway=(8.0, 4.0), yaw_coulomb=0.5, yaw_breakaway=1.0)
    many = firm.held_share(np.array([[2.4, -1.6, 0.1], [0.0, 6.0, 0.0], [0.0, 0.0, 0.75]]))
    assert many == pytest.approx([0.5, 1.5, 0.75])


@pytest.mark.parametrize(
    "coulomb, yaw, holds", [(1.0, 0.1, True), (1e-9, 1e-9, True), (1.0, 0.0, False), (0, 0.1, False)]
)
def test_whether_there_is_a_motion_that_nothing_holds(coulomb, yaw, holds):
    assert DirectionFriction(coulomb=(coulomb, coulomb), yaw_coulomb=yaw).holds_all == holds


def test_the_numbers_of_an_ellipse_in_a_plant():
    law = {"coulomb": (2.0, 1.5), "breakaway": (3.0, 2.5), "viscous": 0.5, "stribeck_speed": 0.04}
    yaw = {"yaw_coulomb": 0.1, "yaw_breakaway": 0.15, "yaw_viscous": 0.02, "yaw_stribeck_speed": 0.5}
    body, element = of(direction=DirectionFriction(**law, **yaw, stribeck_exponent=1.5, stribeck_shape="lorentzian"))
    assert body.coulomb.tolist() == [2.0, 1.5]
    assert body.breakaway.tolist() == [3.0, 2.5]
    assert (body.active, body.plain, body.form, body.exponent) == (1.0, 0.0, 1.0, 1.5)
    assert body.fall == pytest.approx(25.0)
    assert element["viscous"][:3] == pytest.approx([0.5, 0.5, 0.02 / RHO**2])
    assert element["coulomb"][2] == pytest.approx(np.full(2, 0.1 / RHO))
    assert element["breakaway"][2] == pytest.approx(np.full(2, 0.15 / RHO))
    assert element["fall"][:3] == pytest.approx([0.0, 0.0, 1.0 / (RHO * 0.5)])
    assert element["exponent"][2] == 1.5
    assert not element["breakaway"][[0, 1, 3, 4, 5]].any()
    held = of(direction=DirectionFriction(coulomb=(2.0, 1.5), yaw_coulomb=0.1))  # without a breakaway
    assert held.body.breakaway.tolist() == [2.0, 1.5]
    assert held.element["breakaway"][2] == pytest.approx(np.full(2, 0.1 / RHO))
    assert held.body.fall == held.element["fall"].max() == 0.0
    assert of(direction=DirectionFriction(coulomb=(2.0, 1.5), ellipse="plain")).body.plain == 1.0


def test_a_plain_ellipse_is_of_coulombs_law_alone():
    for more in ({"law": "karnopp"}, {"stribeck_speed": 0.1, "breakaway": (2.0, 2.0)}):
        with pytest.raises(InputError, match='ellipse = "plain" is of law = "coulomb" without stribeck_speed'):
            DirectionFriction(coulomb=(1.0, 1.0), ellipse="plain", **more)


# ---- the numbers of the laws -------------------------------------------------------------------------------


def test_the_numbers_of_bristles_on_the_axes():
    numbers = {"stiffness": (1e4, 2e4, 50.0), "damping": (30.0, 40.0, 0.5), "damping_speed": (0.1, 0.2, 2.0)}
    row = of(axes=AxesFriction(viscous=(1.0, 2.0, 0.03), coulomb=C, law="lugre", **numbers)).element[:3]
    assert row["stiffness"] == pytest.approx([1e4, 2e4, 50.0 / RHO**2])
    assert row["damping"] == pytest.approx([30.0, 40.0, 0.5 / RHO**2])
    assert row["fade"] == pytest.approx([10.0, 5.0, 1.0 / (2.0 * RHO)])
    assert row["bristle_coulomb"][:, 0] == pytest.approx([2.0, 1.5, 0.1 / RHO])
    assert row["viscous"] == pytest.approx([1.0, 2.0, 0.03 / RHO**2])
    assert not row["coulomb"].any()
    assert not row["breakaway"].any()


def test_a_damping_that_is_left_out_is_critical():
    """2 sqrt(sigma0 M) - viscous, never below 0; about yaw by its inertia; at a wheel by the mass that it moves."""
    axes = AxesFriction(viscous=(1.0, 1e3, 0.03), coulomb=C, law="lugre", stiffness=(1e4, 1e4, 50.0))
    row = of(axes=axes).element[:3]
    assert row["damping"] == pytest.approx(
        [2.0 * math.sqrt(1e4 * MASS) - 1.0, 0.0, (2.0 * math.sqrt(50.0 * INERTIA) - 0.03) / RHO**2]
    )
    direction = DirectionFriction(coulomb=(2.0, 2.0), viscous=3.0, law="elastoplastic", stiffness=1e4)
    assert of(direction=direction).body.damping == pytest.approx(2.0 * math.sqrt(1e4 * MASS) - 3.0)
    element = of(wheels=WheelFriction(coulomb=0.5, viscous=0.25, law="lugre", stiffness=2e4)).element
    moved = MASS / (np.linalg.norm(element["g"][3:], axis=1) ** 2)
    assert element["damping"][3:] == pytest.approx(2.0 * np.sqrt(2e4 * moved) - 0.25)
    assert element["viscous"][3:] == pytest.approx(np.full(3, 0.25))


def test_numbers_stand_only_where_their_level_acts():
    """An axis without a level has no bristle, no fall and no band."""
    level = {"viscous": NONE, "coulomb": (2.0, 0.0, 0.1)}
    bristles = of(axes=AxesFriction(**level, law="dahl", stiffness=(1e4,) * 3, dahl_exponent=1.5)).element
    assert (bristles["stiffness"] > 0.0).tolist() == [True, False, True, False, False, False]
    assert bristles["dahl_exponent"].tolist() == [1.5, 0.0, 1.5, 0.0, 0.0, 0.0]
    share = of(axes=AxesFriction(**level, law="elastoplastic", stiffness=(1e4,) * 3, elastic_share=0.25)).element
    assert share["elastic"].tolist() == [0.25, 0.0, 0.25, 0.0, 0.0, 0.0]
    falls = of(axes=AxesFriction(**level, breakaway=(3.0, 0.0, 0.1), stribeck_speed=(0.02, 0.02, 0.2))).element
    assert falls["fall"].tolist() == [50.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    band = of(axes=AxesFriction(**level, law="karnopp", karnopp_speed=(1e-3, 1e-3, 1e-2))).element
    assert band["band"] == pytest.approx([1e-3, 0.0, 1e-2 * RHO, 0.0, 0.0, 0.0])
    backward = of(axes=AxesFriction(viscous=NONE, coulomb=NONE, coulomb_backward=(0.0, 1.0, 0.0), law="karnopp"))
    assert backward.element["band"].tolist() == [0.0, 1e-4, 0.0, 0.0, 0.0, 0.0]
    disc = of(direction=DirectionFriction(coulomb=(1.0, 1.0), yaw_coulomb=0.1, law="karnopp", yaw_karnopp_speed=0.02))
    assert (disc.body.band, disc.element["band"][2]) == (1e-4, pytest.approx(0.02 * RHO))


def test_yaw_of_a_direction_has_bristles_of_its_own():
    numbers = {"stiffness": 1e4, "damping": 30.0, "damping_speed": 0.1, "coulomb": (2.0, 2.0), "law": "lugre"}
    yaw = {"yaw_stiffness": 50.0, "yaw_damping": 0.5, "yaw_damping_speed": 2.0, "yaw_coulomb": 0.1}
    body, element = of(direction=DirectionFriction(**numbers, **yaw))
    assert (body.stiffness, body.damping, body.fade) == (1e4, 30.0, pytest.approx(10.0))
    row = element[2]
    assert (row.stiffness, row.damping) == (pytest.approx(50.0 / RHO**2), pytest.approx(0.5 / RHO**2))
    assert row.fade == pytest.approx(1.0 / (2.0 * RHO))
    assert row.bristle_coulomb == pytest.approx(np.full(2, 0.1 / RHO))
    assert body.law == row.law == 1.0  # the second of LAWS


def test_what_a_law_is_by_its_source():
    """Dahl 1976 has one level; only what is elastic at first does not drift (Dupont et al. 2002)."""
    assert list(KINDS) == ["coulomb", "karnopp", "dahl", "lugre", "elastoplastic"]
    assert {word: kind.bends for word, kind in KINDS.items() if kind.bends} == dict.fromkeys(
        ("dahl", "lugre", "elastoplastic"), True
    )
    assert [word for word, kind in KINDS.items() if not kind.falls] == ["karnopp", "dahl"]
    assert [word for word, kind in KINDS.items() if not kind.drifts] == ["elastoplastic"]
    for place in ("axes", "direction", "wheels"):
        assert words_of(place) == tuple(KINDS)
    assert words_of("motor") == ()


@pytest.mark.parametrize(
    "numbers, words",
    [
        (
            {"yaw_stiffness": 1.0},
            'yaw_stiffness is of law = "dahl" or "lugre" or "elastoplastic"; this table has law =',
        ),
        ({"yaw_karnopp_speed": 1.0}, 'yaw_karnopp_speed is of law = "karnopp"; this table has law = "coulomb"'),
        ({"dahl_exponent": 1.1, "law": "lugre", "stiffness": 1.0, "yaw_stiffness": 1.0}, 'is of law = "dahl"; this'),
        ({"law": "dahl", "yaw_stiffness": 1.0}, 'law = "dahl" needs stiffness beside coulomb'),
        ({"law": "dahl", "stiffness": 1.0}, 'law = "dahl" needs yaw_stiffness beside yaw_coulomb'),
        (
            {"law": "dahl", "stiffness": 1.0, "yaw_stiffness": 1.0, "stribeck_speed": 0.1},
            'law = "dahl" has one level, coulomb: .*; law = "lugre" or law = "elastoplastic" has both',
        ),
        (
            {"law": "dahl", "stiffness": 1.0, "yaw_stiffness": 1.0, "yaw_breakaway": 0.2},
            'law = "dahl" has one level, yaw_coulomb: no yaw_breakaway and no yaw_stribeck_speed',
        ),
        (
            {"law": "elastoplastic", "stiffness": 1.0, "yaw_stiffness": 1.0, "breakaway": (2.0, 2.0)},
            'law = "elastoplastic" with a breakaway needs stribeck_speed',
        ),
        (
            {"law": "karnopp", "yaw_stribeck_speed": 0.1},
            'law = "karnopp" slides with yaw_coulomb at once: leave yaw_str',
        ),
    ],
)
def test_what_does_not_go_together_along_the_direction_of_travel(numbers, words):
    with pytest.raises(InputError, match=words):
        DirectionFriction(coulomb=(1.0, 1.0), yaw_coulomb=0.1, **numbers)


def test_what_goes_together():
    """Bristles that hold nothing need no stiffness; a level falls from breakaway, or from none."""
    assert DirectionFriction(coulomb=(0.0, 0.0), law="dahl").law == "dahl"
    assert DirectionFriction(coulomb=(1.0, 1.0), law="dahl", stiffness=1e3).stiffness == 1e3
    assert DirectionFriction(coulomb=(1.0, 1.0), law="lugre", stiffness=1e3, stribeck_speed=0.1).stribeck_speed == 0.1
    assert WheelFriction(coulomb=1.0, stribeck_speed=0.1).stribeck_speed == 0.1
    law = {"law": "elastoplastic", "stiffness": 1e3, "breakaway": 2.0, "stribeck_speed": 0.1}
    assert WheelFriction(coulomb=1.0, **law).elastic_share == 0.7


# ---- all friction of a robot --------------------------------------------------------------------------------

PLAIN = AxesFriction(viscous=(1.0, 1.0, 0.01), coulomb=C)
FALLS = {"stribeck_speed": (0.1, 0.1, 1.0)}


@pytest.mark.parametrize(
    "axes, is_plain",
    [
        ({}, True),
        ({"breakaway": S}, True),
        ({"breakaway": C, **FALLS}, True),  # it falls by nothing
        (FALLS, True),
        ({"breakaway": S, **FALLS}, False),
        ({"coulomb_backward": C}, True),
        ({"coulomb_backward": CB}, False),
        ({"breakaway_backward": S}, False),
        ({"breakaway": S, "breakaway_backward": S}, True),
        ({"breakaway": S, "coulomb_backward": C}, False),  # S backward is then C
        ({"law": "karnopp"}, False),
        ({"law": "dahl", "stiffness": (1e4,) * 3}, False),
    ],
)
def test_which_friction_is_the_papers(axes, is_plain):
    law = PLAIN.replace(**axes)
    assert law.is_plain == Friction(axes=law).only_axes == is_plain
    assert not Friction(axes=law).beyond_axes


def test_where_friction_acts():
    """Axes first; each place by itself, and what holds a robot."""
    nothing = AxesFriction(viscous=NONE, coulomb=NONE)
    disc, wheels = DirectionFriction(coulomb=(1.0, 1.0)), WheelFriction(coulomb=0.5)
    friction = Friction(axes=PLAIN, direction=disc, wheels=wheels)
    assert friction.laws == (PLAIN, disc, wheels)
    for law, only_axes, beyond_axes, only_direction in (
        (Friction(), True, False, True),
        (Friction(axes=PLAIN), True, False, False),
        (Friction(axes=nothing.replace(viscous=(1.0, 1.0, 0.1))), True, False, True),
        (Friction(axes=nothing.replace(breakaway=S)), True, False, False),
        (Friction(axes=nothing.replace(breakaway_backward=S)), False, False, False),
        (Friction(direction=disc), False, True, True),
        (Friction(direction=DirectionFriction(viscous=1.0)), False, True, True),
        (Friction(wheels=wheels), False, True, False),
        (Friction(direction=disc, wheels=wheels), False, True, False),
        (friction, False, True, False),
    ):
        assert (law.only_axes, law.beyond_axes, law.only_direction) == (only_axes, beyond_axes, only_direction)


def test_the_same_levels_without_bristles():
    axes = AxesFriction(viscous=NONE, coulomb=C, breakaway=S, **FALLS)
    friction = Friction(
        axes=axes.replace(law="lugre", stiffness=(1e4,) * 3),
        wheels=WheelFriction(coulomb=0.5, law="dahl", stiffness=1e4),
    )
    rigid = friction.rigid
    assert (rigid.axes.law, rigid.wheels.law, rigid.direction) == ("coulomb", "coulomb", friction.direction)
    numbers, expected = plant(AXEBOT.replace(friction=rigid)), of(axes=axes, wheels=WheelFriction(coulomb=0.5))
    for key in ("coulomb", "breakaway", "fall"):
        np.testing.assert_array_equal(numbers.element[key], expected.element[key])
    assert not numbers.element["bristle_coulomb"].any()
    plain = Friction(axes=PLAIN)
    assert plain.rigid is plain


@pytest.mark.parametrize(
    "axes, direction, refused",
    [
        ({}, {}, False),
        (FALLS, {}, True),
        ({}, {"yaw_stribeck_speed": 0.1}, True),
        ({"law": "karnopp"}, {}, True),
        ({}, {"law": "karnopp"}, True),
        ({"law": "karnopp", "coulomb": (1.0, 1.0, 0.0)}, {}, False),
        ({"law": "karnopp"}, {"yaw_coulomb": 0.0}, False),
    ],
)
def test_two_laws_about_yaw_are_refused(axes, direction, refused):
    parts = PLAIN.replace(**axes), DirectionFriction(**{"coulomb": (1.0, 1.0), "yaw_coulomb": 0.1} | direction)
    if refused:
        with pytest.raises(InputError, match="friction about yaw stands in"):
            Friction(axes=parts[0], direction=parts[1])
    else:
        assert Friction(axes=parts[0], direction=parts[1]).laws[:2] == parts


def test_karnopps_band_goes_beside_what_sticks_and_beside_no_bristles():
    band, bristle = PLAIN.replace(law="karnopp"), WheelFriction(coulomb=0.5, law="dahl", stiffness=1e4)
    assert Friction(axes=band, wheels=WheelFriction(coulomb=0.5)).axes.law == "karnopp"
    assert Friction(axes=PLAIN, wheels=bristle).wheels.law == "dahl"
    with pytest.raises(InputError, match=r'law = "karnopp" rests in its band, .* of \[friction\.wheels\] never rest'):
        Friction(axes=band, wheels=bristle)


# ---- the paper's box ----------------------------------------------------------------------------------------


def test_eqs_4_to_6():
    """F = -(B v + C sgn v), and at rest what balances the drive up to S; a stronger one meets C. Many at once too."""
    law = AxesFriction(viscous=(1.0, 2.0, 0.5), coulomb=C, breakaway=S)
    twist = np.array([[0.5, -0.25, 0.0], [0.0, 0.0, -2.0]])
    applied = np.array([[9.0, 9.0, 0.15], [-3.0, 1.8, 9.0]])
    np.testing.assert_allclose(law.sliding_wrench(twist), [[-2.5, 2.0, 0.0], [0.0, 0.0, 1.1]], rtol=1e-15)
    np.testing.assert_array_equal(law.holds(applied), [[False, False, True], [True, False, False]])
    np.testing.assert_allclose(law.wrench(twist, applied), [[-2.5, 2.0, -0.15], [3.0, -1.5, 1.1]], rtol=1e-15)
    assert law.levels[2].tolist() == list(S)
    assert AxesFriction(viscous=NONE, coulomb=C).levels[2].tolist() == list(C)
