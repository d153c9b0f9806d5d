"""The methods of an identification: a type each, with its own options, as Python and the command line both take them.

What an option does stands in the metadata of its field: the command line makes its flags and help of it, and the page
of the API its tables.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable
from dataclasses import Field, dataclass, field, fields
from functools import cache
from typing import Any, ClassVar, Literal, get_args, get_type_hints

from omnidyn.errors import InputError

AUTO, NONE = "auto", "none"
OUTPUT_ERROR, STEADY_STATE = "output-error", "steady-state"
GAUSS, STUDENT = "gaussian", "student-t"
NU = 4.0  # degrees of freedom of Student's t: 2 % of outliers hardly count, 95 % efficient without them
REST, FREE = "rest", "free"
LINE = "line"  # a shape: the paper's line on each axis
HOLD_OUT, GROUPS, QUICK = "hold_out", "groups", "quick"  # what `identify` takes for some of the methods

# What is wrong with a word that is none of the choices of an option, where "unknown NAME" does not say it.
WRONG_WORDS = {
    "method": "no such method",
    "what": "nothing of that name",
    "speed": "no such speed",
    "force_from": "no such origin of the force",
    "rest": "unknown use of rows at rest",
}


def option(
    default: Any, words: str, python_words: str = "", *, metavar: str = "", flag: str | None = "", first: bool = False
) -> Any:
    """A field: `words` say what it does, `python_words` what only Python need know.

    Args:
        metavar, flag: on the command line; "" for the name of the field, None for an option that it does not have.
        first: whether a user needs it first, in the help of the command line.
    """
    return field(
        default=default,
        metadata={"words": words, "more": python_words, "metavar": metavar, "flag": flag, "first": first},
    )


@cache
def choices(kind: type) -> dict[str, tuple[str, ...]]:
    """Option of a method -> the words that it may be, by its type."""
    return {name: words for name, hint in get_type_hints(kind).items() if (words := _words(hint))}


def _words(hint: Any) -> tuple[str, ...]:
    return get_args(hint) if getattr(hint, "__origin__", None) is Literal else ()


def refuse_word(name: str, value: str, known_words: tuple[str, ...]) -> None:
    """Refuse a value that is none of the known words. Raises InputError."""
    if value not in known_words:
        *first, last = filter(None, known_words)
        words = WRONG_WORDS.get(name, f"unknown {name}")
        raise InputError(words, got=value, expected=f"{', '.join(first)} or {last}", where=name)


@dataclass(frozen=True)
class Method:
    """How robots are identified. A single name stands for a tuple of it.

    name: its own. word: of `method` on the command line, which the one for motors shares with that of whole robots.
    takes: which arguments of `identify` it has a use for. Raises InputError for words that mean nothing.
    """

    name: ClassVar[str] = ""
    word: ClassVar[str] = ""
    takes: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        choices_by_name = choices(type(self))
        for spec in fields(self):
            value = getattr(self, spec.name)
            if takes_names(spec):
                value = _names(spec.name, value)
            elif spec.name in choices_by_name:
                refuse_word(spec.name, value, choices_by_name[spec.name])
            value = ADAPTED[spec.name](value) if spec.name in ADAPTED else value
            object.__setattr__(self, spec.name, value)

    def __init_subclass__(cls) -> None:
        """Add every option to the docstring, for help()."""
        lines = []
        for name in cls.__annotations__:
            spec = cls.__dict__.get(name)
            if metadata := getattr(spec, "metadata", None):
                text = f"{name}: {metadata['words']} {metadata['more']}".rstrip()
                lines += textwrap.wrap(text, 112, initial_indent="    ", subsequent_indent="        ")
        cls.__doc__ = f"{cls.__doc__}\n\n" + "\n".join(lines) + "\n    "


def takes_names(spec: Field[Any]) -> bool:
    """Whether an option is a name or several."""
    return spec.default == () or spec.name in ("free", "nuisances", "outputs")


def _names(option_name: str, value: Any) -> tuple[str, ...] | None:
    """A name or several as a tuple; None as it is. Raises InputError for what is no name."""
    names = (value,) if isinstance(value, str) else value
    if names is not None and (not isinstance(names, Iterable) or not all(isinstance(name, str) for name in names)):
        raise InputError("not a name or several", got=value, expected="text, or a list of texts", where=option_name)
    return None if names is None else tuple(names)


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
    try:
        low, high = (float(share) for share in window)
    except (TypeError, ValueError):  # neither two, nor numbers
        low, high = math.nan, math.nan
    if not 0.0 <= low < high <= 1.0:
        received = ",".join(map(str, window)) if isinstance(window, tuple | list) else window
        raise InputError("not two shares", got=received, expected="such as 0.4,0.95", where="window")
    return low, high


def _draws(count: Any) -> int:
    """A number of draws. Raises InputError for what is none."""
    from omnidyn.arguments import is_whole  # brings NumPy, which options of the command line do without

    if not is_whole(count) or count < 0:
        raise InputError("not a number of draws", got=count, expected="0 or a whole number above it", where="bootstrap")
    return int(count)


def _tick(size: Any) -> float | None:
    """The step of an encoder [rad], None where the log tells it. Raises InputError for what is no size."""
    from omnidyn.arguments import is_number  # brings NumPy, as above

    if size is not None and (not is_number(size) or not 0.0 <= size < math.inf):
        raise InputError("not the step of an encoder", got=size, expected="0 rad or more, or None", where="tick_rad")
    return size


ADAPTED = {"nuisances": _nuisances, "window": _shares, "bootstrap": _draws, "tick_rad": _tick}
NUISANCES = (
    "Fit what the log does: latency, gain, dead_band, fade, tilt, push, none; default: auto.",
    '"latency.twist" is that of one channel, "push.x" of one axis; a tilt stays in the room. None or "auto": '
    "latency and dead band, and the gain where the supply is only nominal, as far as the logs determine them; a "
    'warning says what else would fit the logs better. () or "none": none. Of the motors: latency, offset, dead_band; '
    "None: what improves held-out blocks.",
)
LOSS = "gaussian, or student-t for logs with outliers."
SPEED = "Which speed friction is a function of: wheel, set or ground."
WINDOW = ("Use these shares of each command's rows, such as 0.4,0.95.", "None: the steady rows found.")
MOTOR_INPUT = "Of the motors: voltage, duty, current or force; default: the first."


@dataclass(frozen=True)
class OutputError(Method):
    """Whole logs: the numbers whose free run under the logged inputs comes nearest to all that was measured."""

    name: ClassVar[str] = OUTPUT_ERROR
    word: ClassVar[str] = OUTPUT_ERROR
    takes: ClassVar[tuple[str, ...]] = (HOLD_OUT, GROUPS, QUICK)

    free: tuple[str, ...] | None = option(
        None,
        "Fit this instead of the friction and all guesses; friction is all of it.",
        'Keys of the robot file, such as "body.mass_kg"; that of a list stands for its items. None: the friction that '
        "the robot has, and every number that has a std which no earlier fit wrote. Such a std is a prior, listed or "
        "not. The EMF constant follows the torque constant, wheel by wheel, unless both are listed. Breakaway "
        'follows coulomb, or stays as the robot has it; "friction.axes.breakaway[0]" asks for its interval, without '
        '"[0]" for all; so do those of friction.direction and friction.wheels.',
        metavar="KEY",
        first=True,
    )
    fixed: tuple[str, ...] = option((), "Leave this as the robot file has it.", metavar="KEY", flag="fix", first=True)
    nuisances: tuple[str, ...] | None = option(None, *NUISANCES, metavar="NAME", flag="nuisance")
    loss: Literal["gaussian", "student-t"] = option(GAUSS, LOSS)
    per_free: tuple[str, ...] = option(
        (),
        "What each group has for itself instead.",
        "Of the free numbers, or of the nuisances; the others are shared. By default all friction that is free.",
        metavar="KEY",
    )
    profile: tuple[str, ...] = option(
        (),
        "Interval by profile of the likelihood.",
        "It is scaled by the sandwich where that is used. A number that each group has for itself is profiled in each, "
        "and so are its differences.",
        metavar="KEY",
    )
    bootstrap: int = option(
        0,
        "Intervals from N draws of whole runs instead.",
        "Std and intervals of all come from them; runs of a group are drawn among themselves. Deterministic.",
        metavar="N",
    )
    ladder: bool = option(
        False,
        "Switch on what the model leaves out, step by step, while it pays.",
        "Each step fits the logs with each of the best remedies of `lack_of_fit`, and takes the one that best predicts "
        "blocks of the logs that it was not fitted to, where BIC says so too; the simpler one within a standard error. "
        "`Estimate.ladder` has all that was tried.",
    )
    start: Literal["auto", "rest", "free"] = option(
        AUTO, "How logs begin: rest, free, or auto: at rest where that shows."
    )
    outputs: tuple[str, ...] | None = option(
        None,
        "What is fitted to.",
        'Of "twist", "wheel_speed", "current", "pose" (or of "heading", "position"), "wheel_angle". None: all that '
        "the log has, but for what is computed from another one: that would count the same data twice.",
        flag=None,
    )
    covariance: Literal["auto", "white", "autoregressive", "sandwich"] = option(
        AUTO,
        "white, autoregressive, sandwich, or auto: autoregressive where residuals are not white.",
        "An autoregression of the errors sets estimate and intervals. The sandwich stays where there is none: for "
        "Student's t, for counts, from 20 runs on, and where none makes the residuals white.",
        flag=None,
    )
    tick_rad: float | None = option(
        None,
        "Of the encoders behind wheel angles [rad].",
        "None: found in the log. Their likelihood is that of counts; 0 takes them like any other output, and wheel "
        "speeds that are differences of counts as they are.",
        flag=None,
    )


@dataclass(frozen=True)
class SteadyState(Method):
    """Friction from stretches of constant speed, or from a table of steady points (the paper's way)."""

    name: ClassVar[str] = STEADY_STATE
    word: ClassVar[str] = STEADY_STATE
    takes: ClassVar[tuple[str, ...]] = (GROUPS, QUICK)

    shape: str = option(
        AUTO, "box, disc, ellipse, wheel, wheels, disc+wheel, ...; auto: the best; line: per axis, the paper."
    )
    speed: Literal["wheel", "set", "ground"] = option("wheel", SPEED)
    force_from: Literal["current", "voltage", ""] = option(
        "", "current or voltage; default: current where all logs have it.", "A current is signed as the torque."
    )
    window: tuple[float, float] | None = option(None, *WINDOW, metavar="A,B")
    rest: Literal["bound", "line", "ignore"] = option(
        "bound", "Of a table: what a row at rest says: bound, line (the paper) or ignore."
    )
    robust: bool = option(True, "Points far from the shape pull less.", flag=None)
    rest_speed: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0), "Of a table: speeds up to this count as rest, per axis [m/s, m/s, rad/s].", flag=None
    )
    absolute_std: bool = option(False, "Of a table: its stds are exact; else only their ratios count.", flag=None)


@dataclass(frozen=True)
class MotorLine(Method):
    """The line of each motor, input against speed, wheels off the ground: from windows, or from a table of motors."""

    name: ClassVar[str] = "motor-line"
    word: ClassVar[str] = STEADY_STATE

    input: str = option("", MOTOR_INPUT)
    speed: Literal["wheel", "set", "ground"] = option("wheel", SPEED)
    window: tuple[float, float] | None = option(None, *WINDOW, metavar="A,B")
    steady: bool = option(
        False, "Of the motors: only rows that are steady.", "Else windows that need not be, start-ups too.", flag=None
    )


@dataclass(frozen=True)
class MotorFit(Method):
    """Each motor as a free run of whole logs, wheels off the ground: by what improves held-out blocks, and plain."""

    name: ClassVar[str] = "motor-fit"
    word: ClassVar[str] = OUTPUT_ERROR
    takes: ClassVar[tuple[str, ...]] = (HOLD_OUT,)

    input: str = option("", MOTOR_INPUT)
    between: str = option(AUTO, "Of the motors: input holds, mean of two rows, or a curve.")
    nuisances: tuple[str, ...] | None = option(None, *NUISANCES, metavar="NAME", flag="nuisance")
    loss: Literal["gaussian", "student-t"] = option(GAUSS, LOSS)


FRICTION_METHODS, MOTOR_METHODS = (OutputError, SteadyState), (MotorFit, MotorLine)
METHODS = (OutputError, SteadyState, MotorLine, MotorFit)


def refuse_unless_method(method: object) -> None:
    """Refuse what is neither a method nor None, such as its name. Raises InputError."""
    if method is not None and not isinstance(method, Method):
        spellings = ", ".join(f"omnidyn.{kind.__name__}()" for kind in METHODS)
        received = method if isinstance(method, str) else getattr(method, "__name__", type(method).__name__)
        raise InputError(
            "a method is a value with its options, not a name",
            got=received,
            expected="one of the four methods",
            where="method",
            remedy=f"say one of {spellings}",
        )


def degrees(loss: str) -> float:
    """Degrees of freedom of a loss; 0 for Gaussian noise."""
    return NU if loss == STUDENT else 0.0
