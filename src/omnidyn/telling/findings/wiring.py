"""What `check` says of the order, sign and frame of columns."""

from __future__ import annotations

from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, either
from omnidyn.telling.small_words import SOURCES, by_number

SLOTS = "put the columns right in the mapping (`column`)"


def _wiring(statement: Statement) -> str:
    """Which column belongs where, and with which sign."""
    slots, columns, signs = (statement.numbers[name] for name in ("slots", "columns", "signs"))
    moved = [k for k, column in enumerate(columns) if column != slots[k]]
    parts = []
    if len(moved) == 2:
        parts.append(f"{slots[moved[0]]} and {slots[moved[1]]} are exchanged")
    elif moved:
        parts.append("; ".join(f"{columns[k]} is actually {slots[k]}" for k in moved))
    turned = [column for column, sign in zip(columns, signs, strict=True) if sign < 0.0]
    if turned:
        parts.append(f"{' and '.join(turned)} {by_number(turned, 'has', 'have')} the opposite sign")
    return ", and ".join(parts)


def _wired(statement: Statement) -> str:
    """Columns are exchanged or have the opposite sign: of wheels, of motors, or of the axes over the floor."""
    n = statement.numbers
    return _of_axes(statement) if "of_pose" in n else _of_wheels(statement)


def _of_axes(statement: Statement) -> str:
    """Axes of the twist or the pose against the wheels."""
    n, heading = statement.numbers, statement.subject in ("heading", "omega")
    pose = n["of_pose"]
    channel = f"{n['channel']} and pose" if pose else n["channel"]
    also = f", and so {by_number(pose, 'has', 'have')} {' and '.join(pose)} of the pose" if pose else ""
    turning = " (a positive speed of all wheels must turn the robot counter-clockwise)" if heading else ""
    other = ", or else all wheels have the opposite sign" if heading else ""
    return f"{channel} against the wheels: {n['wiring']}{also}{turning}; as logged they share \
{100 * n['explained_as_logged']:.0f} % of their motion, after correction {100 * n['explained_put_right']:.0f} %{other}"


def _of_wheels(statement: Statement) -> str:
    """Columns of wheels or motors against another channel."""
    n = statement.numbers
    if "blamed" in n:
        against = f"the {n['against']} of the robot" if n["against"] else "what the wheels must agree on"
    else:
        against = f"{SOURCES.get(n['against'], n['against'])} of the same motor"
    motors = (
        "; its voltage, current and speed agree, so the whole motor is meant" if n.get("blamed") == "motors" else ""
    )
    more = f", or {n['as_good'] - 1:.0f} more" if n["as_good"] > 1 else ""
    rival = f" (or, not distinguishable with this log, {n['rival']}{more})" if "rival" in n else ""
    return f"{n['channel']} against {against}: {n['wiring']}{motors}{rival}; as logged \
{100 * n['unexplained_as_logged']:.0f} % remains unexplained, after correction {100 * n['unexplained_put_right']:.1f} %"


def _inverted(statement: Statement) -> str:
    """A column has the opposite sign."""
    n, subject = statement.numbers, statement.subject
    if "wiring" in n:
        return _wired(statement)
    if "position" in n:
        which = f"{n['blamed']} has the opposite sign" if n["blamed"] else "one of the two has the opposite sign"
        return f"{compared(statement)}: {which}"
    if "source" in n:
        return (
            f"{subject} has the opposite sign of what {SOURCES[n['source']]} says, while the other wheels agree with it"
        )
    if "likeness" in n:
        names = subject.split()
        goes, has = by_number(names, "goes", "go"), by_number(names, "it has", "they have")
        against = f"{' and '.join(names)} {goes} the other way than the voltages drive the robot (likeness \
{n['likeness']:.2f})"
        if statement.remedy == "mixed":
            return f"{against}, and another axis does not follow them either: the motors are in another order, or have \
another sign, than in the robot file"
        signs = f"{has} the opposite sign{', or the voltages have it' * (len(names) == 3)}"
        return f"{against}: {signs}, or the motors are in another order than in the robot file"
    return f"{subject} goes the other way than the wheels say ({n['ratio']:.3g} +-{n['error']:.2g} of it): it has the \
opposite sign, or all wheels have"


def _inverted_remedy(statement: Statement) -> str:
    """Another sign for a column."""
    n = statement.numbers
    if "position" in n:
        return "set `invert` for that column in the mapping"
    return SLOTS if "source" in n else "set `invert` for that column in the mapping, or turn the wheels' signs"


def compared(statement: Statement) -> str:
    """A position and a speed that do not agree."""
    n = statement.numbers
    position, speed = n["position"], n["speed"]
    third = f", and {SOURCES[n['source']]} agrees with {n['agrees_with']}" if n.get("source") else ""
    return f"{position} {by_number(position, 'changes', 'change')} {n['ratio']:.4g} times as fast as {speed} \
{by_number(speed, 'says', 'say')}{third}"


def _marker_angle(statement: Statement) -> str:
    """The marker of the pose is mounted at an angle."""
    n = statement.numbers
    agrees = f" ({SOURCES[n['agrees']]} agrees)" if n["agrees"] else ""
    return f"the heading is {n['angle_deg']:.1f} deg (+-{n['error_deg']:.1g}) ahead of what \
{SOURCES[n['source']]}{agrees} \
and the path say: the marker is mounted at that angle"


def _pose_frame(statement: Statement) -> str:
    """A pose in another frame than its heading or than the twist."""
    n = statement.numbers
    likeness = f"(likeness {n['likeness_as_logged']:.2f} as logged, {n['likeness']:.2f} after correction)"
    if "angle_deg" not in n:
        have = by_number(statement.subject, "has", "have")
        return (
            f"{' and '.join(statement.subject.split())} of the pose {have} the opposite sign of what vx, vy and omega \
say {likeness}"
        )
    mirrored = " and mirrored" if n["mirrored"] else ""
    return f"x and y of the pose are turned by {n['angle_deg']:.0f} deg{mirrored} against its heading and the wheels \
{likeness}"


def _turned_frame(statement: Statement) -> str:
    """A frame of the pose that is turned."""
    angle = -statement.numbers["angle_deg"]
    return f"turn the frame of the pose, or take the angle off its heading: `assume` marker={angle:.0f}deg"


OF_WHEELS = {
    "axes": "set `invert` for {subject:that column|these columns} in the mapping, or turn the wheels' signs in the "
    "same way",
    "motors": SLOTS,
    "wheels": f"{SLOTS}, or the order and signs of the wheels in the robot file",
}
SENTENCES = {
    "wiring": Sentence(_wiring),
    "swapped": Sentence(_wired, "", OF_WHEELS),
    "inverted": Sentence(
        _inverted,
        _inverted_remedy,
        {
            **OF_WHEELS,
            "drive": "set `invert` for {subject:that column|these columns} in the mapping; where all logs show it, put "
            "the wheels of the robot file in the order of the motors",
            "mixed": f"{SLOTS}, with `invert` for the wrong signs, or put the wheels of the robot file in the order of "
            "the motors",
        },
    ),
    "marker_angle": Sentence(_marker_angle, "take the angle off: `assume` marker={angle_deg:.1f}deg"),
    "pose_frame": Sentence(
        _pose_frame,
        "set `invert` for those columns in the mapping",
        {"turned": _turned_frame, "mirrored": "turn the frame of the pose, or mirror it back"},
    ),
    "pose_unlike": Sentence(
        "the pose does not follow the wheels (likeness {likeness_as_logged:.2f}), which turn as commanded; no turned "
        "or mirrored frame explains it",
        "look at the tracking of the pose; it was not used",
    ),
    "twist_frame": Sentence(
        either(
            "angle_deg",
            "vx and vy are turned by {angle_deg:.1f} deg (+-{error_deg:.1g}) against the pose, and {agrees!t} agrees "
            "with the pose: their sensor is mounted at an angle",
            "vx and vy are in the frame of the room, not of the robot: they are the rates of x and y (likeness "
            "{likeness:.2f}; {likeness_as_logged:.2f} as logged)",
        ),
        "turn them by the heading: `assume` twist=room",
        {"turned": "turn them back: `assume` twist={angle_deg:.1f}deg"},
    ),
}
