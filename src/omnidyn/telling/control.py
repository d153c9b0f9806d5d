"""What tracking, tuning and the demand of a path say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.document import all_of
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence


def _tracked(statement: Statement) -> str:
    """How near a controller keeps a robot to a path, and how often its motors are at their limit."""
    numbers = statement.numbers
    share = f", {100.0 * numbers['rmse'] / numbers['size']:.2g} % of its size" if numbers["size"] > 0.0 else ""
    limit = ""
    if numbers["saturated"] > 0.0:
        limit = f"; its motors are at their limit in {100.0 * numbers['saturated']:.2g} % of the steps"
    return (
        f"the controller {statement.subject} keeps {numbers['plant']} within {_length(numbers['worst'])} of the path "
        f"{numbers['path']}, {_length(numbers['rmse'])} in the mean{share}{limit}"
    )


def _best_tracked(statement: Statement) -> str:
    """The best of several controllers, and how many times as far off the others are."""
    names, times = statement.numbers["others"], statement.numbers["times"]
    pairs = zip(names, times, strict=True)
    others = ", ".join(f"{name} {float(f'{ratio:.2g}'):g} times as far off" for name, ratio in pairs)
    return f"{statement.numbers['best']}; {others}"


def _length(value: float) -> str:
    return f"{1e3 * value:.3g} mm" if value < 1.0 else f"{value:.3g} m"


def _can_follow(statement: Statement) -> str:
    """A robot can follow a path, between its corners, and what that takes."""
    corners = statement.numbers["corners"]
    between, jumps = (" between its corners", f"; at its {corners} corners no robot can") if corners else ("", "")
    return f"the robot {statement.subject} can follow {statement.numbers['path']}{between}: {_volts(statement)}{jumps}"


def _cannot_follow(statement: Statement) -> str:
    """A robot cannot follow a path in some of its time, and what that would take."""
    path, share = statement.numbers["path"], 100.0 * statement.numbers["share"]
    robot = f"the robot {statement.subject}"
    return f"{robot} cannot follow {path} in {share:.2g} % of its time: that takes {_volts(statement)}"


def _volts(statement: Statement) -> str:
    numbers = statement.numbers
    words = f"up to {numbers['voltage']:.3g} V of {numbers['voltage_limit']:.3g} V"
    if numbers["current_limit"] is None:
        return words
    slips = " at which a wheel slips" if numbers["grip"] else ""
    return f"{words} and {numbers['current']:.3g} A of {numbers['current_limit']:.3g} A{slips}"


def _gains_tuned(statement: Statement) -> str:
    """Tuned settings, and the error with them and before."""
    numbers = statement.numbers
    pairs = zip(numbers["names"], numbers["gains"], strict=True)
    gains = all_of([f"{name} {_setting(value)}" for name, value in pairs])
    return (
        f"with {gains}, {statement.subject} is {_error(numbers, 'after')} off, {_error(numbers, 'before')} before: "
        f"{100.0 * numbers['less']:.0f} % less in the mean of both"
    )


def _error(numbers: Mapping[str, Any], which: str) -> str:
    return f"{1e3 * numbers[which]:.3g} mm and {1e3 * numbers[f'heading_{which}']:.3g} mrad"


def _setting(value: float | tuple[float, ...]) -> str:
    return " ".join(f"{number:g}" for number in (value if isinstance(value, tuple) else (value,)))


def _gains_kept(statement: Statement) -> str:
    """The settings at the start stay: nothing that was tried is better where the search has not been."""
    numbers, name = statement.numbers, statement.subject
    return (
        f"{name} keeps the settings it began with: {_error(numbers, 'before')} off; the best of "
        f"{numbers['evaluations']} tried is {_error(numbers, 'after')} off, "
        f"{-100.0 * numbers['less']:.0f} % more in the mean of both"
    )


def _optimised(statement: Statement) -> str:
    """What was optimised, over which robots."""
    numbers = statement.numbers
    robots = (
        f"{numbers['draws']} robots drawn from the std and correlations of the file"
        if numbers["uncertain"]
        else f"{numbers['draws']} robots near that of the file, no number of which has a std (windings within "
        f"{100.0 * numbers['resistance']:g} %, mass {100.0 * numbers['mass']:g} %, radius of the wheels "
        f"{100.0 * numbers['radius']:g} %)"
    )
    return (
        f"optimised: the geometric mean of rms position and heading error along {all_of(numbers['paths'])}, free "
        f"and pushed, over {robots}; sensors {numbers['sensors']}, noise {numbers['noise']:g} m/s, delay "
        f"{numbers['delay']} steps, {numbers['dt']:g} s a step; {numbers['evaluations']} settings tried; "
        "one robot in three 10 ms later, one 10 ms earlier with sensors a step worse"
    )


def _judged_elsewhere(statement: Statement) -> str:
    """On what tuned settings are judged."""
    return (
        "the numbers are those of other robots, noise and pushes, which the search has not seen, along "
        f"{all_of(statement.numbers['paths'])}"
    )


SENTENCES = {
    "tracked": Sentence(_tracked),
    "best_tracked": Sentence(_best_tracked),
    "steps_with_status": Sentence("{count} of {steps} steps: {subject}"),
    "pose_lag_of_log": Sentence(
        "controllers of {subject} take poses as {pose_delay:.3g} s old, as in the log of the fit, but as new where "
        "they move with the wheels from the first step on; is your loop fed otherwise? If its poses are new, "
        'write twist = "{twist}" and pose_delay_s = 0 under [sensors] of the robot file, else their age and rate'
    ),
    "can_follow": Sentence(_can_follow),
    "cannot_follow": Sentence(_cannot_follow),
    "path_asks_for": Sentence(
        "{subject} asks for up to {speed:.3g} m/s and {acceleration:.3g} m/s2, {turn:.3g} rad/s and "
        "{turn_acceleration:.3g} rad/s2"
    ),
    "speed_jumps": Sentence("its speed jumps at {corners} corners, by up to {jump:.3g} m/s and {turn_jump:.3g} rad/s"),
    "gains_tuned": Sentence(_gains_tuned),
    "gains_kept": Sentence(_gains_kept),
    "optimised": Sentence(_optimised),
    "tuned_margins": Sentence(
        "outputs may act {delay:m.3g} ms later than they do, and be {gain:.2g} times as strong, before the loop no "
        "longer settles"
    ),
    "judged_elsewhere": Sentence(_judged_elsewhere),
    "given_up_rest": Sentence("given up: rest: a voltage changes by {after:.3g} V a step, {before:.3g} V before"),
    "given_up_on_file": Sentence(
        "given up: the robot as the file says it: {after:m.3g} mm, {before:m.3g} mm before: the price of being "
        "right for the others"
    ),
    "given_up_on_worst": Sentence("given up: the worst robot: {after:m.3g} mm, {before:m.3g} mm before"),
    "given_up_nothing": Sentence("given up: nothing that was measured"),
}
