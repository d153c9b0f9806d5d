"""Table 1 of the paper through eqs (15)-(17): the numbers of Table 2, and what can be said about them.

Checked twice: against the literal numbers, and against numpy.linalg.lstsq and scipy.stats.linregress.
"""

import json
import re

import numpy as np
import pytest
from scipy import stats

from omnidyn.document import plain
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.logs.steady_table import SteadyTable, read_steady_table
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from tests.support.codes import codes

SPEED = {"x": [0, 0.37, 0.74, 1.08], "y": [0, 0.42, 0.75, 1.08], "yaw": [0, 5.84, 8.04, 10.02]}
FORCE = {"x": [2.25, 2.48, 2.79, 3.28], "y": [1.47, 1.97, 2.33, 2.49], "yaw": [0.10, 0.14, 0.18, 0.21]}
VOLTAGE = {
    "x": [(0, 1.2, -1.2), (0, 2, -2), (0, 3, -3), (0, 4, -4)],
    "y": [(-1.5, 0.75, 0.75), (-3, 1.5, 1.5), (-4, 2, 2), (-5, 2.5, 2.5)],
    "yaw": [(0.25,) * 3, (1.5,) * 3, (2,) * 3, (2.5,) * 3],
}
AXES = ["x", "y", "yaw"]

# viscous, coulomb, half-widths of the 95 % intervals
ALL_ROWS = {
    "x": (0.9382, 2.1863, 0.55, 0.38),
    "y": (0.9659, 1.5217, 0.50, 0.34),
    "yaw": (0.01073, 0.09337, 0.008, 0.056),
}
MOVING_ROWS = {"x": (1.123, 2.031), "y": (0.788, 1.672), "yaw": (0.0168, 0.0430)}


def table_1(with_voltage=False, axes=AXES):
    volts = [row for axis in axes for row in VOLTAGE[axis]] if with_voltage else None
    return SteadyTable(
        axis=[axis for axis in axes for _ in SPEED[axis]],
        speed=[value for axis in axes for value in SPEED[axis]],
        force=[value for axis in axes for value in FORCE[axis]],
        voltage=volts,
    )


@pytest.fixture(scope="module")
def robot():
    return load_robot("axebot")


def keys(axis):
    return f"friction.axes.viscous[{AXES.index(axis)}]", f"friction.axes.coulomb[{AXES.index(axis)}]"


@pytest.mark.parametrize("axis", AXES)
def test_the_papers_way_gives_table_2(robot, axis):
    fit = fit_steady_state(robot, table_1(), rest_use="line")
    viscous, coulomb = keys(axis)
    b, c, half_b, half_c = ALL_ROWS[axis]
    assert float(f"{fit.value[viscous]:.4g}") == b
    assert float(f"{fit.value[coulomb]:.5g}" if c > 1 else f"{fit.value[coulomb]:.4g}") == c
    for name, half in ((viscous, half_b), (coulomb, half_c)):
        low, high = fit.ci95[name]
        assert (high - low) / 2 == pytest.approx(half, abs=0.5 * 10 ** -len(str(half).partition(".")[2]))
    assert fit.degrees_of_freedom[viscous] == 2


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("rest, first", [("line", 0), ("bound", 1), ("ignore", 1)])
def test_it_agrees_with_linregress_and_lstsq(robot, axis, rest, first):
    fit = fit_steady_state(robot, table_1(), rest_use=rest)
    speed, force = np.array(SPEED[axis][first:]), np.array(FORCE[axis][first:])
    line = stats.linregress(speed, force)
    t = stats.t.ppf(0.975, len(speed) - 2)
    for name, value, error in zip(keys(axis), line[:2], (line.stderr, line.intercept_stderr), strict=True):
        assert fit.value[name] == pytest.approx(value, rel=1e-10)
        assert fit.std[name] == pytest.approx(error, rel=1e-9)
        assert fit.ci95[name] == pytest.approx((value - t * error, value + t * error), rel=1e-9)
    solution = np.linalg.lstsq(np.stack([speed, np.ones_like(speed)], axis=1), force)[0]
    assert [fit.value[name] for name in keys(axis)] == pytest.approx(solution, rel=1e-10)
    assert fit.correlation.between(*keys(axis)) == pytest.approx(-speed.mean() / np.sqrt(np.mean(speed**2)), rel=1e-9)


@pytest.mark.parametrize("axis", AXES)
def test_moving_rows_only(robot, axis):
    fit = fit_steady_state(robot, table_1())
    for name, expected in zip(keys(axis), MOVING_ROWS[axis], strict=True):
        digits = len(str(expected).partition(".")[2])
        assert fit.value[name] == pytest.approx(expected, abs=0.5 * 10**-digits)
    assert fit.degrees_of_freedom[keys(axis)[0]] == 1


def test_mirrored_points_give_the_same_line(robot):
    points = table_1()
    side = np.array([1, -1, 1, -1] * 3)
    mirrored = points.replace(speed=points.speed * side, force=points.force * side)
    for rest in ("line", "bound"):
        one, other = (fit_steady_state(robot, each, rest_use=rest) for each in (points, mirrored))
        assert dict(one.value) == pytest.approx(dict(other.value), rel=1e-12)
        assert dict(one.std) == pytest.approx(dict(other.std), rel=1e-9)


def test_rest_bounds_breakaway_and_raises_it_only_above_coulomb(robot):
    fit = fit_steady_state(robot, table_1())
    assert dict(fit.lower_bound) == {
        "friction.axes.breakaway[0]": 2.25,
        "friction.axes.breakaway[1]": 1.47,
        "friction.axes.breakaway[2]": 0.10,
    }
    friction = fit.robot.friction.axes
    assert friction.breakaway == (2.25, friction.coulomb[1], 0.10)
    assert codes(fit.warnings).count("breakaway_from_rest") == 2
    for rest in ("line", "ignore"):
        other = fit_steady_state(robot, table_1(), rest_use=rest)
        assert other.robot.friction.axes.breakaway is None
        assert not other.lower_bound


def test_the_robot_carries_the_numbers_their_errors_and_their_origin(robot, tmp_path):
    path = tmp_path / "table1.csv"
    rows = [f"{axis},{v},{f}\n" for axis in AXES for v, f in zip(SPEED[axis], FORCE[axis], strict=True)]
    path.write_text("axis,speed,force\n" + "".join(rows))
    fit = fit_steady_state(robot, read_steady_table(path))
    back = parse_robot(robot_to_toml(fit.robot))
    assert back == fit.robot
    for name, value in fit.value.items():
        key, index = name.removeprefix("friction.axes.").rstrip("]").split("[")
        assert getattr(back.friction.axes, key)[int(index)] == value
        assert back.priors[name].std == fit.std[name]
        assert back.priors[name].origin == "identified"
        assert back.priors[name].source.startswith("steady state, table1.csv, 12 points, sha256 ")
    assert back.priors["friction.axes.breakaway[0]"].std is None
    assert "lower bound from rest" in back.priors["friction.axes.breakaway[0]"].source
    assert back.motor == robot.motor
    assert back.replace(friction=robot.friction, priors=robot.priors, correlation=None) == robot
    names = fit.correlation.names
    np.testing.assert_allclose(back.correlation.of(names), fit.correlation.matrix, atol=1e-9)


def test_the_rows_of_w_are_faster_than_the_motor_can_turn(robot):
    """EVIDENCE: the three w rows turn 25-29 % faster than the no-load speed; v and v_n do not."""
    fit = fit_steady_state(robot, table_1(with_voltage=True), rest_use="line")
    (warning,) = [warning for warning in fit.warnings if warning.code == "beyond_no_load"]
    assert str(warning).startswith("axis yaw: 3 of 3 moving rows are faster than the no-load speed (25 to 29 % faster)")


def test_force_from_voltage_disagrees_with_the_table(robot):
    fit = fit_steady_state(robot, table_1(with_voltage=True), rest_use="line")
    found = [one for one in fit.warnings if one.code == "forces_disagree" and f"{one.numbers['ratio']:.3g}" == "1.22"]
    assert len(found) == 1
    assert found[0].subject == "x"
    assert "(4 rows, rms difference 0.931 N)" in str(found[0])


def test_summary_and_dict(robot):
    fit = fit_steady_state(robot, table_1(), rest_use="line")
    text = fit.summary()
    assert text.isascii()
    rows = [re.split(r"  +", line) for line in text.splitlines()]
    assert [
        "friction.axes.viscous[0]",
        "0.9382",
        "0.129",
        "[0.3846, 1.492]",
        "N s/m",
        "viscous friction forward",
    ] in rows
    assert [
        "friction.axes.coulomb[2]",
        "0.09337",
        "0.013",
        "[0.03731, 0.1494]",
        "N m",
        "Coulomb friction turning",
    ] in rows
    assert text.startswith("All 6 numbers are known, the widest (viscous friction turning) within 74 %.\n")
    assert "rows at rest count as sliding" in text
    document = json.loads(json.dumps(fit.to_dict(), allow_nan=False))
    assert document["parameters"]["friction.axes.coulomb[1]"]["value"] == fit.value["friction.axes.coulomb[1]"]
    assert document["parameters"]["friction.axes.coulomb[1]"]["unit"] == "N"
    assert document["warnings"] == plain(fit.warnings)
    assert parse_robot(document["robot"]) == fit.robot
