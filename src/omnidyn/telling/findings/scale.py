"""What `check` says of units, scales, slip and lag."""

from __future__ import annotations

from omnidyn.statement import NOTE, Statement
from omnidyn.telling.findings.wiring import compared
from omnidyn.telling.sentence import Sentence, either
from omnidyn.telling.small_words import SOURCES, by_number, names, read_as

REASONS = {
    "motor": "current and speed of its motor change",
    "voltage": "its motor gets a changing voltage",
    "duty": "its motor gets a changing duty",
    "other_motors": "the other motors draw current",
    "wheels": "the wheels say that it changes",
    "omega": "omega says that it turns",
    "turning_wheels": "the wheels say that the robot turns: the heading was not recorded, or the wheels ran in the air",
}
BY_HAND = "roll the robot over a measured distance by hand"


def _unit(statement: Statement) -> str:
    """Values in another unit than they were read in."""
    n = statement.numbers
    likely = read_as(n["mistake"])
    if n["shown_by"] == "derivative":
        return f"{compared(statement)}{likely}"
    if n["shown_by"] == "stall":
        return f"currents of {n['high_A']:.4g} A, where a blocked motor draws {n['stall_A']:.3g} A{likely}"
    if n["shown_by"] == "circuit":
        return f"the currents are {n['factor']:.3g} times what voltage and speed leave for them{likely}"
    if n["shown_by"] == "driver":
        return (
            f"voltages up to {n['high_V']:.4g} V, where the driver of the robot file gives {n['limit_V']:.4g} V{likely}"
        )
    if n["shown_by"] == "speed":
        return f"voltages within -1..1 ({n['high_V']:.3g} at most), while the speeds need {n['needed_V']:.3g} V{likely}"
    if n["shown_by"] == "emf":
        likely = likely or ": the unit of speed or voltage is wrong"
        return f"the wheel speeds imply a back-EMF {n['factor']:.3g} times the voltage applied{likely}"
    are = by_number(statement.subject, "is", "are")
    return f"{names(statement)} {are} {n['factor']:.4g} times what {SOURCES[n['source']]} says{likely}"


def _time_unit(statement: Statement) -> str:
    """A time that is hardly in the unit given."""
    n = statement.numbers
    if "position" in n:
        likely = f" ({read_as(n['mistake'])[2:]})" if n["mistake"] else ""
        return f"{compared(statement)}: the time is not in the unit given{likely}"
    likely = "ms, us or ticks read as seconds" if n["step_s"] > 1.0 else "seconds read as ms or us"
    return f"one row every {n['step_s']:.4g} s: the time is hardly in the unit given ({likely})"


def _scale(statement: Statement) -> str:
    """A position or a speed with a wrong scale."""
    return f"{compared(statement)} (+-{statement.numbers['error']:.2g})"


def _dead(statement: Statement) -> str:
    """A channel that does not change though something says it should."""
    n, subject = statement.numbers, statement.subject
    if "value" in n:
        why = REASONS.get(n["reason"]) or f"{SOURCES[n['reason']]} says that the wheel turns"
        return f"{subject} is {n['value']:.4g} in every row, while {why}"
    if "source" in n:
        return f"{subject} is noise about 0, while {SOURCES[n['source']]} says that the wheel turns"
    return (
        f"{subject} stays as it is while the wheels say that the robot moves: it was not recorded, or the wheels ran \
in the air"
    )


def _dead_remedy(statement: Statement) -> str:
    """What to do about a dead channel."""
    if statement.numbers.keys() & {"value", "source"}:
        return "look at its sensor, its cable and its column; leave it out otherwise"
    return "leave it out of the mapping"


def _covers(statement: Statement) -> str:
    """The path of the robot against what its wheels roll."""
    n = statement.numbers
    return f"the robot covers {n['floor_ratio']:.4g} (+-{n['floor_ratio_error']:.2g}) of the path that its wheels roll"


def _slip(statement: Statement) -> str:
    """Wheels that slip: in a stretch, or the whole log through."""
    n = statement.numbers
    if "from_s" not in n:
        return (
            f"{_covers(statement)}, the whole log through, while voltage and current agree with the wheels: it slips, \
or the wheel radius of the file is too large"
        )
    return f"from t = {n['from_s']:.5g} to {n['to_s']:.5g} s the robot covers {n['ratio']:.3g} (+-{n['error']:.2g}) of \
the path its wheels roll, measured by the rest of the log ({n['inside']:.3g} there, {n['outside']:.3g} elsewhere): it \
slips, or was pushed{_grip(statement)}"


def _grip(statement: Statement) -> str:
    """What the motors push with beside what the floor takes."""
    n = statement.numbers
    if "grips_N" not in n:
        return ""
    limits = ", ".join(f"{limit:.3g}" for limit in n["grips_N"])
    floor = f"the floor of the robot file takes {limits} N of a wheel (traction_mu)"
    if "push_N" not in n:
        return f"; {floor}"
    return f"; the motors push with up to {n['push_N']:.3g} N a wheel there, beyond the limit in \
{100 * n['beyond']:.2g} % of the rows: {floor}"


def _path_ratio(statement: Statement) -> str:
    """A path that is not what the wheels roll."""
    slips = " it slips, or" if statement.numbers["floor_ratio"] < 1.0 else ""
    return (
        f"{_covers(statement)}, the whole log through:{slips} the gear ratio (counts per turn) of the log or the wheel \
radius of the file is wrong"
    )


def _robot_radius_remedy(statement: Statement) -> str:
    """Another robot radius."""
    return f"try a robot radius {1.0 / max(statement.numbers['ratio'], 1e-9):.4g} times as large"


def _axis_ratio(statement: Statement) -> str:
    """One axis covers another share of the path than the other."""
    n, axis = statement.numbers, statement.subject
    other = "y" if axis == "x" else "x"
    return (
        f"along {axis} the robot covers {n['ratio']:.3g} (+-{n['error']:.2g}) of the path that its wheels roll, along \
{other} {n['other']:.3g}: its rollers slip, or its wheels do not stand as the robot file says"
    )


def _lag(statement: Statement) -> str:
    """A channel that is late."""
    n = statement.numbers
    why = ": a speed from differences of counts is late by half a row" if statement.severity == NOTE else ""
    late, early = (" and ".join(n[name].split()) for name in ("late", "early"))
    return f"{late} {by_number(n['late'], 'is', 'are')} {1e3 * abs(n['seconds']):.3g} ms ({abs(n['rows']):.2f} rows, \
+-{n['error']:.2f}) later than {early}{why}"


def _lag_remedy(statement: Statement) -> str:
    """A latency in the mapping; none of poses: a controller needs to know how late they are."""
    if statement.numbers["late"] == "pose":
        return (
            "leave it: identify fits how late poses are and writes it into [log] of the robot file; say under "
            "[sensors] what feeds the loop"
        )
    return f"move its times back by {1e3 * abs(statement.numbers['seconds']):.3g} ms: latency in the mapping"


SENTENCES = {
    "unit": Sentence(_unit, "give the unit of the column (`column` NAME:UNIT) or its side of the gear"),
    "time_unit": Sentence(_time_unit, "give the unit of the time column, such as `column` t=NAME:ms"),
    "scale": Sentence(
        _scale,
        either(
            "blamed",
            "{blamed} has a wrong scale: correct it in the mapping",
            "one of the two has a wrong scale, or the rows are too far apart to show how it moves",
        ),
    ),
    "dead": Sentence(_dead, _dead_remedy),
    "gear": Sentence(
        either(
            "ratio",
            "floor and motors agree that the wheels turn {ratio:.4g} times (+-{error:.2g}) what wheel_speed says: a "
            "wrong gear ratio or a wrong number of counts per turn in the log",
            "by voltage and current the wheels turn {electric_ratio:.4g} times (+-{electric_ratio_error:.2g}) what "
            "wheel_speed says: the gear ratio, the counts per turn, or K and R of the robot file are off",
        ),
        either(
            "ratio",
            "divide by the right gear ratio, or give the right counts per turn",
            "check the gear ratio; roll the robot over a measured distance by hand",
        ),
    ),
    "motor_constants": Sentence(
        "by voltage and current the wheels turn {electric_ratio:.4g} times (+-{electric_ratio_error:.2g}) what "
        "wheel_speed says, while the floor agrees with the wheels: K, R or the gear ratio of the robot file, or "
        "the scale of voltage or current, is off",
        "identify the motor from this log",
    ),
    "slip": Sentence(
        _slip,
        either(
            "from_s",
            "leave those rows out of fits of wheel speed against ground speed",
            "take the motion over the floor for friction; measure the wheel radius by rolling slowly",
        ),
    ),
    "wheel_radius": Sentence(
        "the robot covers {floor_ratio:.4g} (+-{floor_ratio_error:.2g}) of the path that its wheels roll, while "
        "voltage and current agree with the wheels: the wheel radius of the file is too small, or the ground "
        "speed has a wrong scale",
        "try a wheel radius {floor_ratio:.4g} times as large",
    ),
    "path_ratio": Sentence(_path_ratio, f"{BY_HAND}: that tells slip from a wrong radius or gear"),
    "robot_radius": Sentence(
        "the robot turns {ratio:.4g} times (+-{error:.2g}) as fast as its wheels say, while it drives as far as they "
        "say: the robot radius of the file is not that of the robot, or the gyro has a wrong scale",
        _robot_radius_remedy,
    ),
    "axis_ratio": Sentence(
        _axis_ratio, "check azimuth_deg; else take the motion over the floor for friction along this axis"
    ),
    "wheel_scale": Sentence(
        "{subject} reads {ratio:.4g} times what {source!t} says, measured by the other wheels",
        "that wheel has another radius, gear or counter; give it its own in the mapping or the robot file",
    ),
    "lag": Sentence(_lag, _lag_remedy),
}
