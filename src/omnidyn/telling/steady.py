"""What a steady-state study of logs says: its shape of friction, its levels, what is weak, and what to measure next."""

from __future__ import annotations

import math

from omnidyn.document import all_of, both
from omnidyn.identification.selection.blocks import LIMIT_ERRORS
from omnidyn.identification.steady.choice import NOT_COMPARED
from omnidyn.identification.steady.operating_points import ANGLE, FORCES, SPEEDS
from omnidyn.identification.steady.shapes import SHAPES
from omnidyn.model.keys import Key, unit
from omnidyn.model.layout import YAW
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, either

PRACTICAL = 50.0  # times as many runs
LOST = {
    "current": "the sign of the currents is lost (`current_unsigned`)",
    "voltage": "the sign of the voltages or speeds is wrong, or K_t, K_v, the gear or a radius of the robot file is",
}
NOT_USED = {
    "not_in_model": "no robot file can hold it",
    "below_zero": "a level of it came out below 0",
    "not_asked": "another was asked for",
}
BOTH_SIDES = " on both sides of the change within the run"


def _steady_method(statement: Statement) -> str:
    """How the levels of friction were made: shape, weights, origin of forces and speeds, and of the std."""
    numbers = statement.numbers
    weights = "robust least squares" if numbers["robust"] else "least squares"
    return (
        f"steady state from logs, shape {numbers['shape']}, {weights} on the force vector; forces from "
        f"{FORCES[numbers['force_from']]}; {SPEEDS[numbers['speed_from']]}; std by jackknife over {numbers['folds']} "
        "directions or runs"
    )


def _shape_chosen(statement: Statement) -> str:
    """Which shape friction has, and its error in directions that were left out; beside that of a box on the axes."""
    numbers = statement.numbers
    box = f", {_error(numbers['box'])} for a box on the axes" if numbers["box"] else ""
    return (
        f"friction has the shape {statement.subject}, {SHAPES[statement.subject].words}: it predicts the force in a "
        f"direction left out within {_error(numbers['error'])}{box}"
    )


def _group_shape(statement: Statement) -> str:
    """A group whose shape is not that of the others."""
    numbers = statement.numbers
    other = f", {_error(numbers['other_error'])} for {numbers['other']}" if numbers["other"] else ""
    return (
        f"{statement.subject} has a shape of its own, {numbers['shape']}, {SHAPES[numbers['shape']].words}: within "
        f"{_error(numbers['error'])}{other}"
    )


def _error(value: tuple[float, float]) -> str:
    return "{:.2f} +- {:.2f} N".format(*value)


def _shapes_tied(statement: Statement) -> str:
    """Shapes that the data cannot tell from the best."""
    ties = zip(statement.numbers["shapes"], statement.numbers["behind"], strict=True)
    words = ", ".join(f"{name} ({behind:+.2f} +- {std:.2f} N)" for name, (behind, std) in ties)
    return f"not distinguishable from {statement.subject}, the best: {words}"


def _better_shape_not_used(statement: Statement) -> str:
    """The best shape is not the chosen one, the data tell the two apart, and why it is not taken."""
    behind, why = _error(statement.numbers["behind"]), NOT_USED[statement.numbers["why"]]
    return f"{statement.subject} does better still, by {behind}, but {why}"


def _no_shape_fits(statement: Statement) -> str:
    """No offered shape fits, and what would."""
    numbers = statement.numbers
    if remedy := numbers["with"]:
        same = f"; as well do: {', '.join(numbers['same'])}" if numbers["same"] else ""
        words = (
            f"with {remedy} beside {numbers['shape']} the error in a direction left out is {numbers['error']:.2g} N, "
            f"without {numbers['error_before']:.2g} N{same}"
        )
    else:
        words = f"errors repeat when a direction is driven again, {100.0 * numbers['share']:.0f} % of their square"
    sides = BOTH_SIDES if numbers["changes"] else ""
    return f"no offered shape fits{sides}: {words}; no robot file holds that, and the intervals do not count it"


def _viscous(statement: Statement) -> tuple[Key, str, str]:
    """(key, "B = 0.1 +- 0.02 N s/m, 95 % [..]", "from 0.1 to 0.4 m/s")."""
    key, numbers = Key.parse(statement.subject), statement.numbers
    interval = "{} = {:.3g} +- {:.2g} {}, 95 % [{:.3g}, {:.3g}]".format(
        key.symbol, numbers["value"], numbers["std"], key.unit, numbers["low"], numbers["high"]
    )
    speed = "rad/s" if key.axis == YAW else "m/s"
    return key, interval, f"from {numbers['slow']:.3g} to {numbers['fast']:.3g} {speed}"


def _viscous_with_back_emf(statement: Statement) -> str:
    """Viscous friction cannot be told from back-EMF, for motor constants are guesses: only their sum is known."""
    numbers, (key, interval, _) = statement.numbers, _viscous(statement)
    total = f"{numbers['value'] + numbers['back_emf']:.3g} +- {numbers['sum_std']:.2g} {key.unit}"
    return (
        f"viscous friction is not distinguishable from back-EMF, because {_guesses(numbers['guesses'])}: together they "
        f"are {key.symbol} + {numbers['back_emf']:.3g} = {total}; with the guess {interval}"
    )


def _guesses(names: tuple[str, ...]) -> str:
    return f"{all_of(names)} {'is a guess' if len(names) == 1 else 'are guesses'}"


def _viscous_not_identifiable(statement: Statement) -> str:
    """The interval of a viscous level contains 0: it is left at 0, and bounded."""
    numbers, (key, interval, speeds) = statement.numbers, _viscous(statement)
    force = "N m" if key.axis == YAW else "N"
    share = f"{100.0 * numbers['effect'] / numbers['level']:.1f} %" if numbers["level"] > 0.0 else "a part"
    size = "up to" if numbers["matters"] else "no more than"
    return (
        f"viscous friction is not identifiable here: {interval} contains 0; {speeds} it changes the force by {size} "
        f"{numbers['effect']:.2g} {force} ({share} of {numbers['level']:.3g} {force}); it is left at 0, {key.symbol} "
        f"may be up to {max(numbers['high'], 0.0):.3g} {key.unit}"
    )


def _force_falls_with_speed(statement: Statement) -> str:
    """A viscous level would be below 0: the force falls with speed."""
    _, interval, speeds = _viscous(statement)
    return f"the force falls with speed: {interval}, {speeds}; a viscous level cannot say that"


def _viscous_seen(statement: Statement) -> str:
    """Viscous friction is seen; whether it is in the shape."""
    _, interval, speeds = _viscous(statement)
    in_shape = statement.numbers["in_shape"]
    used = "it is in the shape" if in_shape else "the shape predicts no better with it, so it is left at 0"
    return f"viscous friction is seen: {interval}, {speeds}; {used}"


def _group_difference(statement: Statement) -> str:
    """A level in two groups, and whether it differs."""
    key, numbers = Key.parse(statement.subject), statement.numbers
    (first, second), (one, other) = numbers["groups"], numbers["values"]
    span = "{:+.3g} [{:.3g}, {:.3g}]".format(numbers["difference"], numbers["low"], numbers["high"])
    verdict = "differs" if numbers["differs"] else "no difference seen"
    return f"{key.symbol}: {first} {one:.3g}, {second} {other:.3g} {key.unit}: {verdict}, {span} {key.unit} (95 %)"


def _changes_within_run(statement: Statement) -> str:
    """The force changes inside a run, when and by how much; whether a shape is needed to tell, and what is gone."""
    numbers = statement.numbers
    what, rests = "at the same command", ""
    if shape := numbers["shape"]:
        what = f"over that of the fitted shape ({shape})"
        rests = "; no command tells it by itself, so it is one only if that shape is right"
    if numbers["vanished"]:
        gone = "a sensor or a motor does not work there, or the wheels are off the floor"
        rests += f"; no force is seen {numbers['vanished']} it: {gone}"
    force = [
        "{:.3g} N [{:.3g}, {:.3g}]".format(numbers[side], *numbers[f"{side}_ci95"]) for side in ("before", "after")
    ]
    low, high = (100.0 * end for end in numbers["ci95"])
    return (
        "{}: the force {} changes within the run, most likely at {:.4g} s (between {:.4g} and {:.4g} s): from {} to "
        "{}, {:+.3g} % [{:.3g}, {:.3g}]; the levels of the fit lie between both{}"
    ).format(
        statement.subject or "the run",
        what,
        numbers["at"],
        *numbers["between"],
        *force,
        100.0 * numbers["change"],
        low,
        high,
        rests,
    )


def _change_in_run(statement: Statement) -> str:
    """A change inside a run, in a few words."""
    numbers = statement.numbers
    ends = both(numbers["before"], numbers["after"])
    levels = f", from {ends[0]} to {ends[1]} N" if ends else ""
    where = statement.subject or "the run"
    return f"{100.0 * numbers['change']:+.3g} %{levels}, in {where} at {numbers['at']:.4g} s"


def _against_motion(statement: Statement) -> str:
    """In many points the force points against the motion, as if friction drove the robot: a sign is lost."""
    wrong, count = statement.numbers["wrong"], statement.numbers["points"]
    return (
        f"in {wrong} of {count} points the force points against the motion, as if friction drove the robot: "
        f"{LOST[statement.subject]}, or a wheel is swapped"
    )


def _shapes_not_compared(statement: Statement) -> str:
    """Shapes that could not be fitted, and why."""
    return f"not compared, {NOT_COMPARED[statement.numbers['why']]}: {', '.join(statement.numbers['shapes'])}"


def _level_at_bound(statement: Statement) -> str:
    """A level of friction would be negative and is 0."""
    key = statement.subject
    return f"{key} is at bound: the best fit has {statement.numbers['free']:.3g} {unit(key)}, friction is not negative"


def _level_kept(statement: Statement) -> str:
    """A level that the data do not show stays as in the robot file."""
    return (
        f"{statement.subject} stays at {statement.numbers['level']:.3g} {unit(statement.subject)}, as in the robot file"
    )


def _rests_on_back_emf(statement: Statement) -> str:
    """Viscous levels are right together with a back-EMF that is a guess only."""
    numbers = statement.numbers
    return (
        f"{', '.join(numbers['levels'])}: correct only together with the back-EMF of this file, because "
        f"{_guesses(numbers['guesses'])}; log currents, or measure the no-load speed"
    )


def _more_directions(statement: Statement) -> str:
    """How many more runs would tell two shapes apart."""
    factor = (LIMIT_ERRORS / statement.numbers["apart"]) ** 2
    amount = (
        f"about {math.ceil(factor)} times as many runs" if factor < PRACTICAL else "far more runs than is practical"
    )
    return f"to tell {statement.subject} from {statement.numbers['best']}: {amount}, in other directions"


SENTENCES = {
    "steady_method": Sentence(_steady_method),
    "shape_chosen": Sentence(_shape_chosen),
    "group_shape": Sentence(_group_shape),
    "shapes_tied": Sentence(_shapes_tied),
    "better_shape_not_used": Sentence(_better_shape_not_used),
    "fit_not_tested": Sentence("whether the shape fits was not tested: too few directions in which all of it moves"),
    "no_lack_of_fit": Sentence(
        either(
            "changes",
            "no lack of fit is seen on both sides of the change within the run: nothing that was tried beside the "
            "shape does better",
            "no lack of fit is seen: nothing that was tried beside the shape does better",
        )
    ),
    "no_shape_fits": Sentence(_no_shape_fits),
    "viscous_with_back_emf": Sentence(_viscous_with_back_emf),
    "viscous_not_identifiable": Sentence(_viscous_not_identifiable),
    "force_falls_with_speed": Sentence(_force_falls_with_speed),
    "viscous_seen": Sentence(_viscous_seen),
    "group_difference": Sentence(_group_difference),
    "internal_force": Sentence("the wheels work against each other with {force:.3g} N (rms): that pushes nowhere"),
    "changes_within_run": Sentence(_changes_within_run),
    "change_in_run": Sentence(_change_in_run),
    "changes_not_tested": Sentence(
        "whether the force changes within a run was not tested in {untested} of {runs} runs, such as {subject}: no "
        "command is held for 4 s or comes again often enough"
    ),
    "against_motion": Sentence(_against_motion),
    "forces_from_voltage": Sentence("forces are from eq (11): only as accurate as R, K_t and K_v of the robot file"),
    "not_turned": Sentence("the robot hardly turned: friction about yaw is not in these data"),
    "shapes_not_compared": Sentence(_shapes_not_compared),
    "level_at_bound": Sentence(_level_at_bound),
    "points_far_from_shape": Sentence("{far} of {points} points lie far from the shape and count less than half"),
    "level_kept": Sentence(_level_kept),
    "rests_on_back_emf": Sentence(_rests_on_back_emf),
    "no_steady_window": Sentence("{empty} of {runs} runs have no steady window, such as {subject}"),
    "windows_accelerate": Sentence(
        "some windows still accelerate: up to {force:.2g} N, mass times that, was taken off their forces"
    ),
    "speeds_from_angles": Sentence(f"speeds of the wheels are from {ANGLE}, finer than a quantised speed"),
    "windows_at_rest": Sentence("{windows} windows at rest were left out"),
    "drive_turned_around": Sentence(
        "drive the same again with the robot turned half around: a floor that is not level changes its side, friction "
        "and sensors do not"
    ),
    "look_beyond_shapes": Sentence(
        "look for what the shapes do not know: azimuths of the wheels in the robot file, rollers that stick, slip"
    ),
    "turn_on_the_spot": Sentence(
        "turn on the spot, both ways, at two speeds or more: that gives the friction about yaw"
    ),
    "drive_at_two_speeds": Sentence("drive at speeds a factor of three apart: that shows, or bounds, viscous friction"),
    "drive_faster": Sentence("drive much faster than now: the viscous part grows with speed, the rest does not"),
    "more_directions": Sentence(_more_directions),
    "pull_once": Sentence(
        "pull the robot with a spring scale once: all forces here are only as accurate as the torque constant"
    ),
}
