"""What a fit to whole logs says of its logs, its way and its numbers: `warnings`, `unused`, `blind` of an Estimate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from omnidyn.document import all_of, short
from omnidyn.model.keys import CENTRE, EMF, ROTOR, TORQUE, WHEEL, find_key, in_words
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, either

WIDER = 1.1  # times the interval for white noise, from which on the factor is named
SAME_DATA = {
    "wheel_speed": "its wheel speeds are differences of its wheel angles",
    "twist": "its twist is computed from its wheels",
}
DRIVERS = {
    "speed_loop": "the speed loop of the robot file makes the voltage from the set speeds",
    "voltage": "the logged voltage drives the model",
    "motor_voltage": "the voltage that reached the motors drives the model",
    "wheel_speed_command": "the set speeds of the wheels drive the model",
}
MOVE = {"x": "drive it forward and back", "y": "drive it sideways", "yaw": "turn it"}
MEASURED = {
    "body.mass_kg": "weigh the robot",
    "wheels.wheel_radius_m": "measure the wheel radius",
    "wheels.robot_radius_m": "measure the robot radius",
    "motor.gear_ratio": "read the gear ratio off its data sheet",
    "motor.resistance_ohm": "measure the resistance of a motor",
    TORQUE: "take the torque constant from the data sheet",
    EMF: "take the emf constant from the data sheet (in SI it is the torque constant)",
    ROTOR: "take the rotor inertia from the data sheet",
    WHEEL: "weigh a wheel",
    CENTRE: "balance the robot on an edge",
    "body.inertia_kg_m2": "measure the inertia (swing the robot)",
    "gain": "measure the voltage at the motors",
}
CURES = (
    MEASURED
    | MOVE
    | {
        "current": "log currents",
        "wheel_speed": "log wheel speeds",
        "twist": "log the speed over the ground, or where the robot is",
        "drive": "drive at several speeds, both ways, with starts and stops",
    }
)


def _wider_than_planned(statement: Statement) -> str:
    """An interval is much wider than was planned."""
    n = statement.numbers
    return (
        f"{in_words(statement.subject)} is known within {100.0 * n['got']:.2g} %, {short(n['times'])} times as wide as "
        "planned: the model misses something, and a number may be farther off than its interval says; identify "
        "without `quick` looks for it"
    )


def _size_fitted(statement: Statement) -> str:
    """Wheel radius and inertia are fitted too, for a latency stood in for them."""
    numbers = statement.numbers
    return (
        f"a latency of {1e3 * numbers['latency']:.3g} ms stood in for {all_of([*map(in_words, numbers['keys'])])}: "
        f"with them fitted too a free run misses {100.0 * numbers['with']:.3g} % of the spread of the outputs on "
        f"held-out blocks of the log, {100.0 * numbers['error']:.3g} % without ({numbers['better']} of "
        f"{numbers['blocks']} blocks are predicted better); they are not those of the robot file"
    )


def _gaps(statement: Statement) -> str:
    """A log has gaps; each part between them is fitted from a start of its own."""
    count, longest = statement.numbers["gaps"], short(statement.numbers["longest"], ".3g")
    gaps = f"a gap of {longest} s" if count == 1 else f"{count} gaps, the longest of {longest} s"
    return f"{statement.subject}: {gaps}: what lies between gaps is fitted from a start of its own"


def _same_data(statement: Statement) -> str:
    """An output that was asked for is computed from another one: the same data count twice."""
    return f"{_computed(statement)}: the same data count twice, and the intervals are too narrow"


def _nothing_new(statement: Statement) -> str:
    """An output is computed from another one, and is not fitted."""
    name = statement.numbers["output"].replace("_", " ")
    return f"{_computed(statement)}: the {name} says nothing new and is not fitted"


def _computed(statement: Statement) -> str:
    name, source = statement.numbers["output"], statement.numbers["computed_from"].replace("_", " ")
    return f"{statement.subject}: {SAME_DATA.get(name, f'its {name} is the integral of its own {source}')}"


def _input_not_used(statement: Statement) -> str:
    """An input of the log drives nothing."""
    return f"{statement.subject}: {DRIVERS[statement.numbers['driver']]}"


def _not_moved(statement: Statement) -> str:
    """An axis never visibly moved: its friction is not fitted. With what it held, where that is known."""
    axis, numbers = statement.subject, statement.numbers
    group, held = numbers.get("group"), numbers.get("held")
    words = (
        f"axis {axis} never visibly moved{f' in {group}' if group else ''}: its friction is not fitted ({MOVE[axis]})"
    )
    if held is None:
        return words
    if not held:
        return f"{words}; nothing drove it"
    dead = ", or its sensor is dead: not one row differs from another, so that no bound is known"
    return f"{words}; it held {held:.3g} {'N m' if axis == 'yaw' else 'N'}{dead if numbers['dead'] else ''}"


def _search_end(statement: Statement) -> str:
    """A number ended where its search ends: it is no estimate."""
    where = f"{statement.numbers['value']:.3g} {statement.numbers['unit']}".rstrip()
    return f"{statement.subject} is at the end of its search range, {where}: that is no estimate"


def _not_white(statement: Statement) -> str:
    """The residuals are not white, and the intervals allow for it by the sandwich covariance."""
    runs = statement.numbers["runs"]
    by = f" by the scatter from run to run ({runs} runs)" if runs else ""
    return f"{_neighbours(statement)}: the intervals allow for it{by}; {_widened(statement)}"


def _memory(statement: Statement) -> str:
    """The residuals are not white; the errors are fitted as an autocorrelated process."""
    numbers = statement.numbers
    least, most = numbers["orders"] or (None, None)
    order = f"{least}" if least == most else f"{least} to {most}"
    ways = [] if least is None else [f"an autoregression of order {order}"]
    if beside := numbers["beside_white"]:
        ways.append(f"white noise beside autocorrelated errors{' while the robot moves' if beside == 'moving' else ''}")
    return (
        f"{_neighbours(statement)}: the errors of each output are fitted as {' or '.join(ways)}, with a memory of up "
        f"to {short(numbers['memory'])} s; {_widened(statement)}"
    )


def _neighbours(statement: Statement) -> str:
    return f"the residuals are not white (correlation of neighbours up to {statement.numbers['neighbours']:.2f})"


def _widened(statement: Statement) -> str:
    factor = statement.numbers["widening"]
    if factor < WIDER:
        return "that makes them no wider"
    return f"that makes them up to {short(factor)} times as wide as for white noise"


def _not_followed(statement: Statement) -> str:
    """The model does not follow outputs: by how much it misses each."""
    still = "it never changes, and the model moves it: a dead sensor"
    parts = [
        f"{name} ({still if share is None else f'errors {100.0 * share:.0f} % of its spread'})"
        for name, share in zip(statement.numbers["outputs"], statement.numbers["shares"], strict=True)
    ]
    return (
        f"the model does not follow {', '.join(parts)}: a sign, a unit, the order of the wheels or the robot file is "
        "wrong; the numbers and intervals of this fit are not usable until it does"
    )


def _cures(statement: Statement) -> str:
    """What would show a direction that the logs do not show."""
    return " or ".join(CURES[cure] for cure in statement.numbers["cures"])


def _not_shown(statement: Statement) -> str:
    """A direction in the numbers that the logs do not show, and what would show it."""
    what = "them apart" if len(statement.numbers["keys"]) > 1 else "it"
    return f"{direction(statement)}; to tell {what}: {cures}" if (cures := _cures(statement)) else direction(statement)


def direction(statement: Statement) -> str:
    """ "mass +10 % and resistance -10 %: not distinguishable with this log"; entries that change alike are one."""
    keys, shares, exact = (statement.numbers[name] for name in ("keys", "changes", "exact"))
    if len(keys) == 1:
        return f"{in_words(keys[0])}: this log {'does not show' if exact else 'hardly shows'} it"
    parts = all_of([f"{name} {short(share, '+.2g')} %" for name, share in _alike(keys, shares)])
    return f"{parts}: {'not' if exact else 'hardly'} distinguishable with this log"


def _alike(keys: Sequence[str], shares: Sequence[float]) -> Iterator[tuple[str, float]]:
    """(words, change [%], the largest is 10 %, the first is positive); entries of a list that change alike are one."""
    scale = 10.0 / max(map(abs, shares)) * (1.0 if shares[0] >= 0.0 else -1.0)
    left = {key: scale * share for key, share in zip(keys, shares, strict=True)}
    while left:
        name, share = next(iter(left.items()))
        key = find_key(name)
        alike = [
            other
            for other, percent in left.items()
            if key is not None
            and (place := find_key(other)) is not None
            and place.name == key.name
            and abs(percent - share) < 0.02 * abs(share)
        ]
        several = key is not None and len(alike) > 1
        yield (in_words(key.name) if key is not None and several else in_words(name)), share
        for other in alike if several else [name]:
            del left[other]


def _combined(name: str, parts: str) -> Callable[[Statement], str]:
    """How a number is named that the logs determine where they do not determine those behind it."""

    def words(statement: Statement) -> str:
        """A number that the logs determine where they do not determine those behind it."""
        between = statement.numbers["correlation"]
        trade = "" if between is None else f", which trade with each other (correlation {between:.2f})"
        axis = "about yaw" if statement.subject == "yaw" else f"along {statement.subject}"
        return f"{name} {axis}: {parts}{trade}"

    return words


SENTENCES = {
    "method_chosen": Sentence("{method}, not output error: {why}"),
    "supply_nominal": Sentence("{subject}: the supply is not logged: its nominal {supply:g} V is taken"),
    "input_beyond_limit": Sentence("{subject}: {rows} rows ask for more than the voltage limit: clipped to it"),
    "split_at_gaps": Sentence(_gaps),
    "split_at_missing_inputs": Sentence("{subject}: {rows} rows lack an input: the log is split there"),
    "split_at_missing_counts": Sentence(
        "{subject}: {rows} rows lack counts of an encoder, or follow on missing rows: the log is split there"
    ),
    "same_data_twice": Sentence(_same_data),
    "nothing_new": Sentence(_nothing_new),
    "counts_as_readings": Sentence(
        "{subject}: wheel speeds are differences of encoder counts (tick {tick:.3g} rad), fitted as they are: {why}"
    ),
    "counts_added_up": Sentence(
        "{subject}: wheel speeds are differences of encoder counts (tick {tick:.3g} rad): fitted as the angles that "
        "they add up to"
    ),
    "uneven_stamps": Sentence("the stamps of the rows are uneven"),
    "counts_missing": Sentence("{lost} of {rows} rows are missing, and what was turned there with them"),
    "output_not_asked": Sentence("{subject}: not among the outputs asked for"),
    "input_not_used": Sentence(_input_not_used),
    "unused_in_some_logs": Sentence("{unused} ({logs} of {of} logs, such as {first})"),
    "counted_once": Sentence("{subject} is the same recording as {first}: it counts once"),
    "in_two_groups": Sentence(
        "{subject} in group {group} is the same recording as {first} in group {other}: the groups are not independent"
    ),
    "begins_in_motion": Sentence(
        "{logs} of {of} logs begin in motion: they are not used, the state of their speed loop is not known there"
    ),
    "used_to_first_gap": Sentence("{logs} logs have gaps: only what stands before the first gap is used"),
    "axis_not_moved": Sentence(_not_moved),
    "axis_not_measured": Sentence(
        either(
            "group",
            "axis {subject} was not measured in {group}: its friction is not fitted",
            "axis {subject} was not measured: its friction is not fitted",
        )
    ),
    "implausible_latency": Sentence(
        either(
            "fitted",
            "{subject} of {latency:m.0f} ms is implausible: the channel would show what the voltage does only later. "
            "The clocks differ, a filter looks ahead (centred speeds), or it stands in for another fault",
            "{subject} of {latency:m.0f} ms is implausible: the channel would show what the voltage does only later. "
            "The clocks differ, a filter looks ahead (centred speeds), or it stands in for another fault: it is not "
            "fitted",
        )
    ),
    "latency_like_zero": Sentence("these logs do not tell {latencies} from 0: the robot file has none of it"),
    "harmful_nuisance": Sentence(
        "{subject} improves the likelihood but worsens the prediction of held-out blocks of the log ({better} of "
        "{blocks} are predicted better without it, {gain:%.2g} % less squared error on average): it is not fitted"
    ),
    "late_by_rows": Sentence(
        either(
            "without",
            "{subject} is late by {latency:m.3g} ms, {rows:.2g} rows of the log (a free run misses {error:%.3g} % of "
            "the spread of held-out outputs, {without:%.3g} % by the best fit without it): a camera, a network or a "
            "filter may be as late; a drive is not, and then something that the model misses stands behind it",
            "{subject} is late by {latency:m.3g} ms, {rows:.2g} rows of the log: a camera, a network or a filter may "
            "be as late; a drive is not, and then an inertia or something else that the model misses stands behind it",
        )
    ),
    "size_fitted": Sentence(_size_fitted, "measure {keys}, and write them into the robot file"),
    "driver_dead_band": Sentence(
        "the driver passes on nothing of the first {values[0]:.3g} V (a dead band): with it a free run misses "
        "{with:%.3g} % of the spread of the outputs on held-out blocks of the log, {error:%.3g} % without "
        "({better} of {blocks} blocks are predicted better)",
        "measure it: the voltage at which a wheel off the ground sets off; Coulomb friction at the wheels looks alike",
    ),
    "constant_force": Sentence(
        "a constant force pushes the robot ({keys}): with it a free run misses {with:%.3g} % of the spread of the "
        "outputs on held-out blocks of the log, {error:%.3g} % without ({better} of {blocks} blocks are "
        "predicted better)",
        "look for a floor that is not level, a cable, a brush, or voltages that are off by a constant; friction that "
        "is not the same both ways looks alike",
    ),
    "plain_predicts_better": Sentence(
        "the fit without {nuisances} predicts {better} of {blocks} held-out blocks of the log better (a free run "
        "misses {plain:%.3g} % of the spread of the outputs, {error:%.3g} % with them): they are not fitted"
    ),
    "white_predicts_better": Sentence(
        "a fit with autocorrelated errors predicts {better} of {blocks} held-out blocks of the log worse (a "
        "free run misses {error:%.3g} % of the spread of the outputs, {white:%.3g} % by least squares): least squares "
        "are taken, and the model misses something"
    ),
    "given_predicts_better": Sentence(
        "the robot as it was given predicts {better} of {blocks} held-out blocks of the log better than the fitted one "
        "(a free run misses {given:%.3g} % of the spread of the outputs, {error:%.3g} % after the fit): it is written",
        "record a longer log, or look for what the model misses",
    ),
    "given_predicts_tail_better": Sentence(
        "the robot as it was given predicts the last 40 % of the log better than a fit to what comes before "
        "({better} of {blocks} blocks, {gain:%.2g} % less squared error): for what comes after this log it may be "
        "the better one",
        "keep the robot as given, or record a longer log: errors that last as long as this one look like friction",
    ),
    "held_out_blocks": Sentence(
        either(
            "given",
            "on held-out blocks of the logs a free run misses {written:%.3g} % of the spread of the outputs; that of "
            "the plain fit {plain:%.3g} %, that of the robot as it was given {given:%.3g} %",
            "on held-out blocks of the logs a free run misses {written:%.3g} % of the spread of the outputs; that of "
            "the plain fit {plain:%.3g} %",
        )
    ),
    "unsettled_nuisances": Sentence(
        "together with {nuisances} these logs do not determine the numbers of the robot: {nuisances} are not fitted"
    ),
    "interrupted": Sentence(
        "the fit was interrupted: the numbers are the best so far, their intervals are those of that point"
    ),
    "group_not_fitted": Sentence("{subject} was not fitted yet: its own numbers are where its fit begins"),
    "iteration_limit": Sentence("the fit stopped after {iterations} iterations: the numbers are of its last step"),
    "not_identifiable": Sentence("{subject} is not identifiable from these logs"),
    "search_end": Sentence(_search_end),
    "bound_of_inertia": Sentence("{subject} is at its bound {value:.3g}: nothing is seen to spin beside the body"),
    "bound_of_breakaway": Sentence(
        "{subject} is at its bound {value:.3g}: the log shows no fall from it to Coulomb friction"
    ),
    "bound": Sentence("{subject} is at its bound {value:.3g}: the best fit lies beyond it"),
    "not_white": Sentence(_not_white),
    "autocorrelated_noise": Sentence(_memory),
    "short_for_memory": Sentence(
        "the errors of {subject} are correlated over {memory:~.2g} s, and the logs last {times:.1f} times that: the "
        "memory is hardly known, nor are the intervals; record {enough:~.2g} s or more"
    ),
    "uneven_rows": Sentence(
        "{share:.0%} of the rows do not come at even times: the errors are taken to forget as much from each row to "
        "the next"
    ),
    "rounded_inputs": Sentence(
        "inputs are logged in steps of {step:.2g} V: the intervals hold what rounding may have changed, and are "
        "up to {wider:~.2g} times as wide for it"
    ),
    "no_fall": Sentence(
        either(
            "high",
            "{subject}: the log shows no fall from it to Coulomb friction, so {speed} is no estimate; it lies between"
            " that and {high:.3g}, at which the robot would have been held",
            "{subject}: the log shows no fall from it to Coulomb friction, so {speed} is no estimate; how far it lies"
            " above that is not known",
        )
    ),
    "karnopp_as_coulomb": Sentence(
        'law = "karnopp" is fitted as Coulomb friction with breakaway: logs do not distinguish the two; karnopp_speed '
        "is numerical and stays as it is"
    ),
    "combined_damping": Sentence(_combined("damping", "viscous friction and braking by back-EMF, together")),
    "combined_push": Sentence(_combined("push", "of the motors per volt at rest")),
    "combined_sets_off": Sentence(_combined("voltage at which it sets off", "dead band and Coulomb friction")),
    "combined_follows": Sentence(_combined("by how much it follows late", "latency and lag")),
    "not_followed": Sentence(_not_followed),
    "wider_than_planned": Sentence(_wider_than_planned),
    "not_shown": Sentence(_not_shown),
    "cures": Sentence(_cures),
}
