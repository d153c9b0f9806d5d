"""Causes of a misfit, as diagnosis and ladder name them: a number that is off, a missing law, a fault of the log."""

from __future__ import annotations

from omnidyn.document import all_of, both, short
from omnidyn.identification.steady.unoffered_parts import TURNED_DEG
from omnidyn.model.keys import BODY_AXES, DIRECTION, find_key, in_words, unit
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence

UNOFFERED = {
    "friction one way": "friction that differs between forward and backward motion",
    "drag": "drag that grows with the square of the speed",
    "turns of the wheels": "a force that repeats with the turns of the wheels",
    "sag": "a supply that sags under load",
    "heat": "motors that weaken as they warm up",
    "filter": "speeds that went through a filter",
    **{
        f"box turned by {angle:.0f} deg": f"a box turned by {angle:.0f} degrees against the body"
        for angle in TURNED_DEG
    },
    "rollers": "friction along the axles of the wheels, where the rollers turn",
    "forward and backward": "another level forward than backward",
    "left and right": "another level to the left than to the right",
    "pull": "a constant pull, by a floor that is not level or an offset of sensors",
    "turning left and right": "another level turning left than right",
}
NUISANCE_UNITS = {"dead_band": "V", "tilt.x": "N", "tilt.y": "N", "push.x": "N", "push.y": "N", "push.yaw": "N m"}
NO_REST = 1e-3  # of what a number was, below which nothing is left of it
SHAPES = {DIRECTION: "an ellipse", BODY_AXES: "a box"}


def named(key: str) -> str:
    """The key of a cause as people call it."""
    return in_words(key) if find_key(key) else UNOFFERED.get(key, key)


def changes(statement: Statement) -> str:
    """ "viscous friction forward 0.5 -> 0.3 N s/m": the numbers that a cause would change, as many as are given."""
    names, before, after = (statement.numbers[name] for name in ("changed", "before", "after"))
    words = []
    for name, now, then in zip(names, before, after, strict=True):
        if ends := both(now, then if abs(then) > NO_REST * abs(now) else 0.0):
            words.append(f"{in_words(name)} {ends[0]} -> {ends[1]} {unit(name)}".rstrip())
    return all_of(words)


def _named(statement: Statement) -> str:
    """A cause of which only the key is known."""
    return named(statement.subject)


def _number_off(statement: Statement) -> str:
    """A number of the robot file is off."""
    return f"{in_words(statement.subject)} {short(100.0 * statement.numbers['change'], '+.2g')} %"


def _switched_on(statement: Statement) -> str:
    """A number of the motors is not 0."""
    return f"{in_words(statement.subject)} {statement.numbers['value']:.2g} {unit(statement.subject)}"


def _fitted(statement: Statement) -> str:
    """Numbers that a fit has found, each with the group that has it for itself."""
    found = []
    for name, value in zip(statement.numbers["keys"], statement.numbers["values"], strict=True):
        key, _, group = name.partition("@")
        words = in_words(key) if find_key(key) else key.replace("_", " ")
        found.append(
            f"{words} {value:.3g} {NUISANCE_UNITS.get(key) or unit(key)}".rstrip() + (f" in {group}" if group else "")
        )
    return all_of(found)


def _late(statement: Statement) -> str:
    """A channel is late."""
    return f"{statement.subject.replace('_', ' ')} late by {1e3 * statement.numbers['late']:.3g} ms"


def _changes(statement: Statement) -> str:
    """Friction, mass or supply changes at some time of the log."""
    numbers = statement.numbers
    at = "" if numbers["at"] is None else f", at {short(numbers['at'], '.3g')} s"
    when = f"{100.0 * numbers['share']:.0f} % into the log{at}"
    if statement.subject == "mass":
        ends = both(numbers["before"], numbers["after"])
        about = f" from {ends[0]} to about {ends[1]} kg" if ends else ""
    else:
        about = f" by about {short(100.0 * numbers['by'], '+.2g')} %" if statement.subject == "supply" else ""
    return f"{statement.subject} that changes{about} {when}"


def _in_one_log(statement: Statement) -> str:
    """Mass, friction or supply is another one in one log."""
    log, other, share = (statement.numbers[name] for name in ("log", "other", "share"))
    size = f", by roughly {short(100.0 * share, '+.1g')} %" if share else ""  # a step finds two thirds of it, or all
    return f"another {statement.subject} in {log} than in {other or 'the other logs'}{size}"


def _other_shape(statement: Statement) -> str:
    """Coulomb friction is of another shape."""
    return f"Coulomb friction of another shape, {SHAPES[statement.subject]}"


def _beside(statement: Statement) -> str:
    """Coulomb friction at the wheels beside that on the body."""
    each = " of its own at each wheel" if statement.numbers["each"] else " at the wheels"
    where = "on the axes" if statement.subject == BODY_AXES else "along the direction of travel"
    return f"Coulomb friction{each} beside that {where}"


SENTENCES = {
    "cause": Sentence(_named),
    "number_off": Sentence(_number_off),
    "gain": Sentence("gain {gain:.3g}"),
    "fading_voltage": Sentence("a voltage that fades by {percent:.2g} %"),
    "dead_band": Sentence("dead band {value:.2g} V"),
    "force_in_the_room": Sentence("a force that stays in the room, as of a floor that is not level"),
    "push_on_the_body": Sentence("a constant push in the body, as of a brush that drags"),
    "late_channel": Sentence(_late),
    "change_on_the_way": Sentence(_changes),
    "differs_in_one_log": Sentence(_in_one_log),
    "turning_frame": Sentence("the forces of a turning frame"),
    "no_turning_frame": Sentence("no forces of a turning frame"),
    "centre_off_the_middle": Sentence("a centre of mass off the middle of the wheels"),
    "other_centre": Sentence("another centre of mass"),
    "current_limit": Sentence("a current limit of about {limit:.2g} A"),
    "current_limit_from": Sentence("a current limit, from {limit:.2g} A"),
    "switched_on": Sentence(_switched_on),
    "gear_efficiency": Sentence("gear efficiency {efficiency:.2g}"),
    "slipping_wheels": Sentence("wheels that slip, at about {share:.2g} of what they carry"),
    "breakaway": Sentence("breakaway above Coulomb friction"),
    "friction_of_travel": Sentence("Coulomb friction along the direction of travel, an ellipse"),
    "friction_of_axes": Sentence("Coulomb friction on each axis by itself, a box"),
    "friction_at_wheels": Sentence("friction at the wheels"),
    "friction_at_wheels_instead": Sentence("friction at the wheels in the place of the other"),
    "friction_beside": Sentence(_beside),
    "friction_at_each_wheel": Sentence("Coulomb friction of its own at each wheel"),
    "other_shape": Sentence(_other_shape),
    "stribeck": Sentence("friction that falls with the speed from breakaway, above Coulomb friction (Stribeck)"),
    "dahl": Sentence("friction that bends before it slips (Dahl)"),
    "lugre": Sentence("friction that bends before it slips, falls and is damped (LuGre)"),
    "outliers": Sentence("noise with outliers, {percent:.2g} % of the samples, that count little (`loss` student-t)"),
    "fitted_numbers": Sentence(_fitted),
    "if_odometry": Sentence("{cause} (of another size if the twist is odometry)"),
    "in_groups": Sentence("{cause} in {groups}"),
    "changes": Sentence(changes),
    "more": Sentence("{count} more"),
    "instead_of": Sentence("{cause} in the place of {step}"),
}
