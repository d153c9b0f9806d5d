"""Question: what is asked of an identification, every option once, as Python and the command line both take it."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from typing import Any, Self

from omnidyn.errors import InputError

AUTO, NONE = "auto", "none"
OUTPUT_ERROR, STEADY_STATE = "output-error", "steady-state"
FRICTION, MOTORS = "friction", "motors"
GAUSS, STUDENT = "gaussian", "student-t"
REST, FREE = "rest", "free"
METHODS = (OUTPUT_ERROR, STEADY_STATE)

# Who takes an option: one of two methods, of friction or of the motors.
FIT, STEADY = (OUTPUT_ERROR, FRICTION), (STEADY_STATE, FRICTION)
MOTOR_FIT, MOTOR_LINES = (OUTPUT_ERROR, MOTORS), (STEADY_STATE, MOTORS)
EVERYONE = (FIT, STEADY, MOTOR_FIT, MOTOR_LINES)

CHOOSE_RUNS = ("hold_out", "per", "group")  # options that say which runs are fitted, and which belong together

# What is wrong with a word that is none of the choices of an option, where "unknown NAME" does not say it.
WRONG = {
    "method": "no such method", "what": "nothing of that name", "speed": "no such speed",
    "force_from": "no such origin of the force", "rest": "unknown use of rows at rest",
}  # fmt: skip


def _option(
    default: Any, words: str, more: str = "", *, of: Sequence[tuple[str, str]], choices: Sequence[str] = (),
    metavar: str = "", flag: str | None = "", first: bool = False,
) -> Any:  # fmt: skip
    """A field: `words` say what it does, `more` what only Python need know.

    of: who takes it. choices: the words that it may be. metavar, flag: on the command line; "" for the name of the
    field, None for an option that the command line does not have; first: one that a user needs first, in its help.
    """
    about = {"words": words, "more": more, "of": tuple(of), "choices": tuple(choices)}
    about |= {"metavar": metavar, "flag": flag, "first": first}
    return field(default=default, metadata=about)


@dataclass(frozen=True)
class Question:
    """What is asked of an identification. A single name stands for a tuple of it.

    Raises InputError for words that mean nothing; `method_asked` for options that do not go together.
    """

    method: str = _option(
        AUTO, "output-error (whole logs; the default) or steady-state (the paper's).",
        '"auto": the first where robot and logs support it, or the one that has the options that are given.',
        of=EVERYONE, choices=(*METHODS, AUTO), first=True,
    )  # fmt: skip
    free: tuple[str, ...] | None = _option(
        None, "Fit this instead of the friction and all guesses; friction is all of it.",
        'Keys of the robot file, such as "body.mass_kg"; that of a list stands for its items. None: the friction that '
        "the robot has, and every number that has a std which no earlier fit wrote. Such a std is a prior, listed or "
        "not. The EMF constant follows the torque constant, wheel by wheel, unless both are listed. Breakaway "
        'follows coulomb, or stays as the robot has it; "friction.axes.breakaway[0]" asks for its interval, without '
        '"[0]" for all; so do those of friction.direction and friction.wheels.',
        of=(FIT,), metavar="KEY", first=True,
    )  # fmt: skip
    fixed: tuple[str, ...] = _option(
        (), "Leave this as the robot file has it.", of=(FIT,), metavar="KEY", flag="fix", first=True,
    )  # fmt: skip
    nuisances: tuple[str, ...] | None = _option(
        None, "Fit what the log does: latency, gain, dead_band, fade, tilt, push, none; default: auto.",
        '"latency.twist" is that of one channel, "push.x" of one axis; a tilt stays in the room. None or "auto": '
        "latency and dead band, and the gain where the supply is only nominal, as far as the logs determine them; a "
        'warning says what else would fit the logs better. () or "none": none.',
        of=(FIT, MOTOR_FIT), metavar="NAME", flag="nuisance",
    )  # fmt: skip
    loss: str = _option(
        GAUSS, "gaussian, or student-t for logs with outliers.", of=(FIT, MOTOR_FIT), choices=(GAUSS, STUDENT)
    )
    hold_out: tuple[str, ...] = _option(
        (), "Do not fit these logs: predict them.", "Globs, or folders, of the sources of runs.",
        of=(FIT, MOTOR_FIT), metavar="GLOB", first=True,
    )  # fmt: skip
    per: tuple[str, ...] = _option(
        (), "A group with friction of its own.", "NAME=GLOB each, of the sources of runs.", of=(FIT,),
        metavar="NAME=GLOB", first=True,
    )  # fmt: skip
    per_free: tuple[str, ...] = _option(
        (), "What each group has for itself instead.",
        "Of the free numbers, or of the nuisances; the others are shared. By default all friction that is free.",
        of=(FIT,), metavar="KEY",
    )  # fmt: skip
    profile: tuple[str, ...] = _option(
        (), "Interval by profile of the likelihood.",
        "It is scaled by the sandwich where that is used. A number that each group has for itself is profiled in each, "
        "and so are its differences.",
        of=(FIT,), metavar="KEY",
    )  # fmt: skip
    bootstrap: int = _option(
        0, "Intervals from N draws of whole runs instead.",
        "Std and intervals of all come from them; runs of a group are drawn among themselves. Deterministic.",
        of=(FIT,), metavar="N",
    )  # fmt: skip
    ladder: bool = _option(
        False, "Switch on what the model leaves out, step by step, while it pays.",
        "Each step fits the logs with each of the best remedies of `lack_of_fit`, and takes the one that best predicts "
        "blocks of the logs that it was not fitted to, where BIC says so too; the simpler one within a standard error. "
        "`Estimate.ladder` has all that was tried.",
        of=(FIT,),
    )  # fmt: skip
    quick: bool = _option(
        False, "Leave out the diagnosis: what the model misses and what the numbers rest on.",
        "The result says so. `ladder` needs the diagnosis.", of=(FIT, STEADY),
    )  # fmt: skip
    start: str = _option(
        AUTO, "How logs begin: rest, free, or auto: at rest where that shows.", of=(FIT,), choices=(AUTO, REST, FREE)
    )
    between: str = _option(AUTO, "Of the motors: input holds, mean of two rows, or a curve.", of=(MOTOR_FIT,))
    what: str = _option(
        FRICTION, "friction, or motors: the line of each motor, wheels off the ground.", of=EVERYONE,
        choices=(FRICTION, MOTORS), first=True,
    )  # fmt: skip
    shape: str = _option(
        AUTO, "box, disc, ellipse, wheel, wheels, disc+wheel, ...; auto: the best; line: per axis, the paper.",
        of=(STEADY,),
    )  # fmt: skip
    speed: str = _option(
        "wheel", "Which speed friction is a function of: wheel, set or ground.", of=(STEADY, MOTOR_LINES),
        choices=("wheel", "set", "ground"),
    )  # fmt: skip
    force_from: str = _option(
        "", "current or voltage; default: current where all logs have it.", "A current is signed as the torque.",
        of=(STEADY,), choices=("current", "voltage", ""),
    )  # fmt: skip
    input: str = _option(
        "", "Of the motors: voltage, duty or current; default: the first.", of=(MOTOR_FIT, MOTOR_LINES)
    )
    window: tuple[float, float] | None = _option(
        None, "Use these shares of each command's rows, such as 0.4,0.95.", "None: the steady rows found.",
        of=(STEADY, MOTOR_LINES), metavar="A,B",
    )  # fmt: skip
    steady: bool = _option(
        False, "Of the motors: only rows that are steady.", "Else windows that need not be, start-ups too.",
        of=(MOTOR_LINES,), flag=None,
    )  # fmt: skip
    group: tuple[str, ...] = _option(
        (), "Logs of one floor or load.", "NAME=GLOB each, of the sources of runs.", of=(STEADY,), metavar="NAME=GLOB"
    )
    rest: str = _option(
        "bound", "Of a table: what a row at rest says: bound, line (the paper) or ignore.", of=(STEADY,),
        choices=("bound", "line", "ignore"),
    )  # fmt: skip
    outputs: tuple[str, ...] | None = _option(
        None, "What is fitted to.",
        'Of "twist", "wheel_speed", "current", "pose" (or of "heading", "position"), "wheel_angle". None: all that '
        "the log has, but for what is computed from another one: that would count the same data twice.",
        of=(FIT,), flag=None,
    )  # fmt: skip
    covariance: str = _option(
        AUTO, "white, autoregressive, sandwich, or auto: autoregressive where residuals are not white.",
        "An autoregression of the errors sets estimate and intervals. The sandwich stays where there is none: for "
        "Student's t, for counts, from 20 runs on, and where none makes the residuals white.",
        of=(FIT,), choices=(AUTO, "white", "autoregressive", "sandwich"), flag=None,
    )  # fmt: skip
    tick_rad: float | None = _option(
        None, "Of the encoders behind wheel angles [rad].",
        "None: found in the log. Their likelihood is that of counts; 0 takes them like any other output, and wheel "
        "speeds that are differences of counts as they are.",
        of=(FIT,), flag=None,
    )  # fmt: skip
    robust: bool = _option(True, "Points far from the shape pull less.", of=(STEADY,), flag=None)

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(each.default, tuple) or each.name in ("free", "nuisances", "outputs"):
                value = value if value is None else (value,) if isinstance(value, str) else tuple(value)
                object.__setattr__(self, each.name, value)
            elif (choices := each.metadata["choices"]) and value not in choices:
                *first, last = (word for word in choices if word and (each.name, word) != ("method", AUTO))
                expected = f"{', '.join(first)} or {last}"
                words = WRONG.get(each.name, f"unknown {each.name}")
                raise InputError(words, got=value, expected=expected, where=each.name)
        object.__setattr__(self, "nuisances", _nuisances(self.nuisances))
        object.__setattr__(self, "window", _shares(self.window))
        if self.quick and self.ladder:
            raise InputError(
                "the ladder climbs by the diagnosis, which `quick` leaves out", got="`quick` and `ladder`",
                remedy="leave out one of them",
            )  # fmt: skip

    @classmethod
    def for_method(cls, method: str, question: Self | None, options: Mapping[str, Any]) -> Self:
        """The question, with options by name put in, asked of one method and of runs that are all fitted together.

        Raises InputError for an option that there is not, that the method does not have, or that chooses among runs.
        """
        found = (question or cls()).but({"method": method, **options} if method else options)
        found.method_asked([*dict.fromkeys((*options, *found.given()))])
        chosen = [name for name in CHOOSE_RUNS if getattr(found, name)]
        if chosen:
            raise InputError("chooses among runs", got=f"`{chosen[0]}`", expected="with Identification.of")
        return found

    def but(self, options: Mapping[str, Any]) -> Self:
        """The question with other options, by name. Raises InputError for one that there is not."""
        for name in options:
            if name not in self.__dataclass_fields__:
                raise InputError("no such option", got=name, expected=", ".join(sorted(self.__dataclass_fields__)))
        return replace(self, **options)

    def given(self) -> tuple[str, ...]:
        """Names of the options that are not as they are by default, but for `method` and `what`."""
        every = (each for each in fields(self) if each.name not in ("method", "what"))
        return tuple(each.name for each in every if getattr(self, each.name) != each.default)

    def method_asked(self, given: Sequence[str] | None = None) -> str:
        """The method by its name, or by options that one method alone has; "auto" where neither says it.

        given: names of the options that were given; by default those that are not as by default.
        Raises InputError for an option of another method, or of something else than is asked for.
        """
        names = [name for name in (self.given() if given is None else given) if name not in ("method", "what")]
        takers = {name: [method for method, what in _of(name) if what == self.what] for name in names}
        for name, methods in takers.items():
            if not methods and self.what == MOTORS:
                raise InputError("not an option of the motors", got=f"`{name}`", where=f"`what` {MOTORS}")
            if not methods:
                raise InputError(
                    "an option of the motors", got=f"`{name}`", expected=f"`what` {MOTORS}", where=f"`{name}`"
                )
        steady = [name for name, methods in takers.items() if methods == [STEADY_STATE]]
        fit = [name for name, methods in takers.items() if methods == [OUTPUT_ERROR]]
        if fit and (self.method == STEADY_STATE or (steady and self.method == AUTO)):
            others = ", ".join(f"`{name}`" for name in steady) or "`method`"
            raise _refusal(STEADY_STATE, fit[0], f"leave it out, or leave out {others}")
        if steady and self.method == OUTPUT_ERROR:
            raise _refusal(OUTPUT_ERROR, steady[0], "for groups use `per`" if steady[0] == "group" else "leave it out")
        return OUTPUT_ERROR if fit else STEADY_STATE if steady else self.method


def _refusal(method: str, name: str, remedy: str) -> InputError:
    (other,) = (each for each in METHODS if each != method)
    return InputError(f"{method} has no such option", got=f"`{name}`", expected=f"with {other}", remedy=remedy)


def _of(name: str) -> tuple[tuple[str, str], ...]:
    """Who takes an option."""
    return Question.__dataclass_fields__[name].metadata["of"]


def _nuisances(names: tuple[str, ...] | None) -> tuple[str, ...] | None:
    """None for automatic ones, () for none."""
    if names is None or not {AUTO, NONE} & set(names):
        return names
    if len(set(names)) > 1:
        raise InputError("none and auto stand alone", got=", ".join(names), where="nuisances")
    return () if NONE in names else None


def _shares(window: Any) -> tuple[float, float] | None:
    """Two shares, or None."""
    if window is None:
        return None
    values = tuple(float(each) for each in window)
    if len(values) != 2 or not 0.0 <= values[0] < values[1] <= 1.0:
        got = ",".join(f"{each:g}" for each in values)
        raise InputError("not two shares", got=got, expected="such as 0.4,0.95", where="window")
    return values


def options() -> tuple[Field[Any], ...]:
    """The fields of a Question, in their order; `metadata` has what `_option` takes, by the names there."""
    return fields(Question)


def _told() -> str:
    """Every option in words, for help() and the pages of the API."""
    told = []
    for each in options():
        takers = each.metadata["of"]
        of = "" if takers == EVERYONE else ", ".join(
            f"{what if what == MOTORS else ''} {method}".strip() for method, what in takers
        )  # fmt: skip
        text = f"{each.name}{f' ({of})' if of else ''}: {each.metadata['words']} {each.metadata['more']}".rstrip()
        told += textwrap.wrap(text, 112, initial_indent="    ", subsequent_indent="        ")
    return "\n".join(told)


Question.__doc__ = f"{Question.__doc__}\n{_told()}\n    "
