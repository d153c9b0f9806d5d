"""A controller of one robot in C: its formulas traced from Python (compiled/trace.py), and what joins them.

What joins them holds no formula of the robot: numbers are checked, errors summed up, outputs kept within limits, as
`Guarded.step` and the controllers' `_output` do.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from omnidyn.compiled.trace import Traced, inputs
from omnidyn.control.controller import LARGEST_STATE, LATEST, MOST_BRIDGED, WHEEL_SPEED, Safe
from omnidyn.control.feedforward import Feedforward
from omnidyn.control.paths.motion import Path, Reference
from omnidyn.control.pid import Pid
from omnidyn.control.speed_loop import MOST_STEPS, SpeedController
from omnidyn.export.code.trace import statements
from omnidyn.export.spelling import c_number, filled
from omnidyn.model.wheels import wheel_speed

# Of the fastest element, in float32: slower is at rest. A sum of three products is off by a few 1e-7.
ROUNDING = 1e-6
AnyOf = Feedforward | Pid | SpeedController
NOTHING = 1e-13  # of the largest share of a motor: it has none
_SUM = """static float summed(float total, float more, float weight)
{
    if (more * total >= 0.0f) { /* of large errors little */
        return total + weight * more;
    }
    return weight < 1.0f && (total + more) * total < 0.0f ? 0.0f : total + more;
}"""
_HELPERS = (
    ("sign_of", "static float sign_of(float a) { return (float)((a > 0.0f) - (a < 0.0f)); }"),
    ("min_of", "static float min_of(float a, float b) { return a < b ? a : b; }"),
    ("max_of", "static float max_of(float a, float b) { return a > b ? a : b; }"),
    ("summed", _SUM),
)


def control_code(controller: AnyOf) -> str:
    """The body of its C file: constants, helpers, what is traced, and what joins it."""
    model = controller.volts.model
    share = np.where(np.abs(model.share) <= NOTHING * np.abs(model.share).max(), 0.0, model.share)
    controller.volts.model = replace(model, share=share, rounding=ROUNDING)
    if isinstance(controller, Feedforward):
        traced, body = _feedforward(controller)
    else:
        traced, body = _pid(controller) if isinstance(controller, Pid) else _speed(controller)
    helpers = [text for name, text in _HELPERS if f"{name}(" in "".join([*traced, body])]
    tables = {"LIMIT": controller.limit} if controller.output == WHEEL_SPEED else _limits(controller)
    if isinstance(controller, Pid) and controller.output == WHEEL_SPEED:
        tables["VOLTAGE_LIMIT"] = controller.commands.limit
    constants = [
        f"static const float {name}[{len(table)}] = {{{c_literals(table)}}};" for name, table in tables.items()
    ]
    numbers = {"FARTHEST": c_literal(LARGEST_STATE), "LARGEST": "3.0e38f", "LATEST": c_literal(LATEST * controller.dt)}
    numbers["STOPS"] = "\n    self->driven = 0;" if is_commanded(controller) else ""
    can_swing = isinstance(controller, Pid)
    numbers["UNSWUNG"] = "\n    memset(&self->swing, 0, sizeof(self->swing));" if can_swing else ""
    numbers["SWUNG"], numbers["SWINGS"] = (", swinging", "swinging ? OMNIDYN_SWINGS : ") if can_swing else ("", "")
    found = "    swinging = swings(&self->swing, elapsed, pose[2], twist, path[0].velocity);\n"
    numbers["SWING"] = found if can_swing else ""
    step = filled(_STEP, WANTED=textwrap.indent(body, "    "), BRIDGED=str(MOST_BRIDGED), **numbers)
    include = ["#include <string.h>"] * can_swing
    parts = [*include, "\n".join(constants), "\n".join(helpers), *traced, *_within(controller), step.strip()]
    return "\n\n".join(part for part in parts if part)


def _limits(controller: AnyOf) -> dict[str, np.ndarray]:
    """Of the voltage of the motors, of their currents where there is one, and of the output."""
    volts = controller.volts
    tables = {"LIMIT": controller.limit, "VOLTAGE_LIMIT": volts.limit}
    return tables | ({"CURRENT_LIMIT": volts.current_limit} if np.isfinite(volts.current_limit).all() else {})


def _within(controller: AnyOf) -> list[str]:
    """`Volts.within` and `Safe._sent` in C, where the output is volts or a duty."""
    if controller.output == WHEEL_SPEED:
        return []
    current = bool(np.isfinite(controller.volts.current_limit).all())
    together = isinstance(controller, SpeedController)
    declarations = ("\n    float share = 1.0f;" if together else "") + ("" if current else "\n    (void)current;")
    text = filled(
        _WITHIN,
        CURRENT=" || fabsf(current[k]) > CURRENT_LIMIT[k]" if current else "",
        OWN=declarations,
        EACH=(_SHARE if together else _CLIP_EACH).lstrip("\n"),
        TOGETHER=_TOGETHER if together else "",
        PER_VOLT=c_literal(float(controller._sent(np.ones(1))[0])),
    )
    return [text.strip()]


class _Given(Path):
    """A path whose motion at the times asked for is what C was given."""

    name, duration, end = "given", 1.0, 1.0

    def __init__(self, pose: Any, velocity: Any) -> None:
        self._motion = Reference(pose, velocity, Traced.of(np.zeros((len(pose.nodes), 3))))

    def at(self, t: Any) -> Reference:
        """The motion that was given, one row for each of the times."""
        return self._motion


def _feedforward(controller: Feedforward) -> tuple[list[str], str]:
    """(functions, statements that put what is wanted into `output`)."""
    names = {"pose": (2, 3), "velocity": (2, 3)}

    def efforts(rests: bool) -> Callable[..., dict[str, Any]]:
        """What to trace, of a robot that rests, or of one that moves."""

        def run(pose: Any, velocity: Any) -> dict[str, Any]:
            twists = _Given(pose, velocity).twist_at(0.0)[1]
            if controller.output == WHEEL_SPEED:
                return {"output": wheel_speed(controller.robot.wheels, 0.5 * (twists[0] + twists[1]))}
            volts = controller.volts
            return _named(volts.starting(twists[1]) if rests else volts.moving(twists[0], twists[1]))

        return run

    head = "float place[2][3], velocity[2][3]"
    if controller.output == WHEEL_SPEED:
        call = f"(void)elapsed;\n{_LOOK_AHEAD}wheel_speeds({_ARGUMENTS}, output);"
        return [_function("wheel_speeds", names, efforts(False), controller)], f"{head};\n{call}"
    functions = [_function(name, names, efforts(name == "starting"), controller) for name in ("moving", "starting")]
    call = (
        "if (velocity[0][0] == 0.0f && velocity[0][1] == 0.0f && velocity[0][2] == 0.0f) {\n"
        f"    starting({_ARGUMENTS}, output, current);\n}} else {{\n"
        f"    moving({_ARGUMENTS}, output, current);\n}}\nlimited = within(output, current);"
    )
    return functions, f"{head}, current[OMNIDYN_WHEELS];\n(void)elapsed;\n{_LOOK_AHEAD}{call}"


def _speed(controller: SpeedController) -> tuple[list[str], str]:
    """(functions, statements that put what is wanted into `output`)."""
    names = {"pose": (3, 3), "velocity": (3, 3)}
    head = "float place[3][3], velocity[3][3]"

    def twists(pose: Any, velocity: Any) -> Any:
        return _Given(pose, velocity).twist_at(0.0)[1]

    if controller.output == WHEEL_SPEED:

        def speeds(pose: Any, velocity: Any) -> dict[str, Any]:
            return {"output": wheel_speed(controller.robot.wheels, twists(pose, velocity)[2])}

        call = f"(void)elapsed;\n{_LOOK_AROUND}wheel_speeds({_ARGUMENTS}, output);"
        return [_function("wheel_speeds", names, speeds, controller)], f"{head};\n{call}"

    def efforts(pose: Any, velocity: Any, off: Any, total: Any) -> dict[str, Any]:
        ahead = twists(pose, velocity)
        return _named(controller.effort(off, ahead[1], ahead[2], total))

    def errors(pose: Any, velocity: Any, twist: Any) -> dict[str, Any]:
        return {"off": controller.due(twists(pose, velocity)) - twist}

    functions = [
        _function("errors", {**names, "twist": (3,)}, errors, controller),
        _function("effort", {**names, "off": (3,), "total": (3,)}, efforts, controller),
    ]
    call = f"{_LOOK_AROUND}errors({_ARGUMENTS}, twist, off);\n{_summed(controller, f'{_ARGUMENTS}, off')}"
    return functions, f"{head}, off[3], more[3], current[OMNIDYN_WHEELS];\n{call}"


def _summed(controller: Pid | SpeedController, arguments: str) -> str:
    """The loop over sums of errors in C: given, the arguments of `effort` before the sum."""
    plain = isinstance(controller, SpeedController)
    raised = "self->sum[k] + off[k] * elapsed" if plain else "summed(self->sum[k], off[k] * elapsed, weight[k])"
    return filled(_SUMMED, LONGEST=c_literal(MOST_STEPS * controller.dt), GIVEN=arguments, RAISED=raised).strip()


def _pid(controller: Pid) -> tuple[list[str], str]:
    """(functions, statements that put what is wanted into `output`)."""
    head, (place, turn) = "float off[3], weight[3], velocity[3][3]", map(c_literal, controller.farthest)
    gather = (
        "for (k = 0; k < 9; k++) {\n    velocity[k / 3][k % 3] = path[k / 3].velocity[k % 3];\n}\n"
        "for (k = 0; k < 3; k++) {\n    off[k] = path[0].pose[k] - pose[k];\n}\n"
        f"off[2] = remainderf(off[2], {c_literal(2.0 * np.pi)});\n"
        f"weight[0] = weight[1] = {place} / max_of({place}, off[0] * off[0] + off[1] * off[1]);\n"
        f"weight[2] = {turn} / max_of({turn}, off[2] * off[2]);\n"
    )
    if controller.output == WHEEL_SPEED:
        call = filled(_COMMANDED, LONGEST=c_literal(MOST_STEPS * controller.dt)).strip()
        return [
            _function("commands", *controller.law(), controller)
        ], f"{head}, more[3], volts[OMNIDYN_WHEELS], then[3], share = 1.0f;\n{gather}{call}"
    call = _summed(controller, "off, pose[2], twist, (const float(*)[3])velocity")
    functions = [_function("effort", *controller.law(), controller)]
    return functions, f"{head}, more[3], current[OMNIDYN_WHEELS];\n{gather}{call}"


def _named(effort: Any) -> dict[str, Any]:
    return {"output": effort.voltage, "current": effort.current}


def _function(
    name: str, arguments: Mapping[str, tuple[int, ...]], run: Callable[..., dict[str, Any]], controller: Safe
) -> str:
    """A function of C: its inputs by name and shape, then its outputs."""
    outputs = run(*(inputs(name, shape) for name, shape in arguments.items()))
    lines = [f"(void){name};" for name in arguments] + statements(outputs, single=True)
    takes = [
        f"const float {name}{''.join(f'[{n}]' for n in shape)}" if shape else f"float {name}"
        for name, shape in arguments.items()
    ]
    takes += [f"float {name}[{len(values.nodes)}]" for name, values in outputs.items()]
    head = textwrap.fill(f"static void {name}({', '.join(takes)})", 110, subsequent_indent="    ")
    return (
        f"/* Traced from {controller.name} of omnidyn. */\n{head}\n{{\n" + "\n".join(f"    {x}" for x in lines) + "\n}"
    )


def c_literals(values: np.ndarray) -> str:
    return ", ".join(map(c_literal, np.asarray(values, dtype=float).tolist()))


def c_literal(value: float) -> str:
    return c_number(float(value), True)


_LOOK_AHEAD = """for (k = 0; k < 6; k++) {
    place[k / 3][k % 3] = path[1 + k / 3].pose[k % 3];
    velocity[k / 3][k % 3] = path[1 + k / 3].velocity[k % 3];
}
"""
_LOOK_AROUND = """for (k = 0; k < 9; k++) {
    place[k / 3][k % 3] = path[k / 3].pose[k % 3];
    velocity[k / 3][k % 3] = path[k / 3].velocity[k % 3];
}
"""
_ARGUMENTS = "(const float(*)[3])place, (const float(*)[3])velocity"

_WITHIN = """
/* Keep the volts within the limits, and make them what the drive takes; whether a limit was met. */
static int within(float volts[OMNIDYN_WHEELS], const float current[OMNIDYN_WHEELS])
{
    int k, met = 0;@OWN@
    for (k = 0; k < OMNIDYN_WHEELS; k++) {
        met |= fabsf(volts[k]) >= VOLTAGE_LIMIT[k]@CURRENT@;
@EACH@        volts[k] *= @PER_VOLT@;
    }@TOGETHER@
    return met;
}
"""
_CLIP_EACH = """
        volts[k] = volts[k] > VOLTAGE_LIMIT[k] ? VOLTAGE_LIMIT[k] : volts[k];
        volts[k] = volts[k] < -VOLTAGE_LIMIT[k] ? -VOLTAGE_LIMIT[k] : volts[k];
"""
_SHARE = """
        share = fabsf(volts[k]) / VOLTAGE_LIMIT[k] > share ? fabsf(volts[k]) / VOLTAGE_LIMIT[k] : share;
"""
_TOGETHER = """
    for (k = 0; k < OMNIDYN_WHEELS; k++) {
        volts[k] /= share;
    }"""

_SUMMED = """
elapsed = elapsed < @LONGEST@ ? elapsed : @LONGEST@;
for (k = 0; k < 3; k++) {
    more[k] = @RAISED@;
}
effort(@GIVEN@, more, output, current);
limited = within(output, current);
if (limited) { /* at a limit, nothing is added to the sum */
    effort(@GIVEN@, self->sum, output, current);
    limited = within(output, current);
} else {
    for (k = 0; k < 3; k++) {
        self->sum[k] = more[k];
    }
}
"""

# Of a drive with a speed loop, `Pid._commanded`.
LOOP_MEMORY = """
    float loop[OMNIDYN_WHEELS], mean[OMNIDYN_WHEELS], reached[3];
    int driven;"""

_COMMANDED = """
elapsed = elapsed < @LONGEST@ ? elapsed : @LONGEST@;
for (k = 0; k < OMNIDYN_WHEELS; k++) {
    self->loop[k] = self->driven ? self->loop[k] + elapsed * (self->last[k] - self->mean[k]) : 0.0f;
}
for (k = 0; k < 3; k++) {
    self->reached[k] = self->driven ? self->reached[k] : twist[k];
    more[k] = summed(self->sum[k], off[k] * elapsed, weight[k]);
}
self->driven = 1;
commands(off, pose[2], (const float(*)[3])velocity, more, 1.0f, self->reached, self->loop, output, self->mean, volts,
         then);
for (k = 0; k < OMNIDYN_WHEELS; k++) {
    share = fabsf(volts[k]) / VOLTAGE_LIMIT[k] <= share ? share : fabsf(volts[k]) / VOLTAGE_LIMIT[k];
}
limited = !(share <= 1.0f);
if (limited) { /* slower, and nothing is added to the sum */
    memcpy(more, self->sum, sizeof(more));
    commands(off, pose[2], (const float(*)[3])velocity, more, share, self->reached, self->loop, output, self->mean,
             volts, then);
}
memcpy(self->sum, more, sizeof(more));
memcpy(self->reached, then, sizeof(then));
"""

_STEP = """
/* Whether all of n numbers are finite, and none is beyond what a place or a speed can be. */
static int sane(const float *values, int n)
{
    int k;
    for (k = 0; k < n; k++) {
        if (!(fabsf(values[k]) <= @FARTHEST@)) {
            return 0;
        }
    }
    return 1;
}

/* Zeros, and why. */
static int safe(omnidyn_control *self, float output[OMNIDYN_WHEELS], int why)
{
    int k;@STOPS@
    for (k = 0; k < OMNIDYN_WHEELS; k++) {
        self->last[k] = output[k] = 0.0f;
    }
    return why;
}

/* What is wanted of a step whose numbers are sane; whether it met a limit. */
static int wanted(omnidyn_control *self, float elapsed, const float pose[3], const float twist[3],
                  const omnidyn_motion path[3], float output[OMNIDYN_WHEELS])
{
    int k, limited = 0;
    (void)self, (void)pose, (void)twist;
    {
@WANTED@
    }
    return limited;
}

void omnidyn_control_reset(omnidyn_control *self)
{
    int k;
    for (k = 0; k < 3; k++) {
        self->sum[k] = 0.0f;
    }@UNSWUNG@
    for (k = 0; k < OMNIDYN_WHEELS; k++) {
        self->last[k] = 0.0f;
    }
    self->begun = self->missing = 0;@STOPS@
#if LATE_ROWS
    memset(&self->late, 0, sizeof(self->late));
#endif
}

int omnidyn_control_step(omnidyn_control *self, float elapsed, const float pose[3], const float twist[3],
                         const omnidyn_motion path[3], float output[OMNIDYN_WHEELS])
{
    int k, limited, why, begun = self->begun@SWUNG@;
#if LATE_ROWS
    float now[3];
#endif
    if (!sane(&elapsed, 1)) {
        return safe(self, output, OMNIDYN_BAD_TIME);
    }
    self->begun = 1;
    if (elapsed < 0.0f) {
        omnidyn_control_reset(self);
        self->begun = 1;
        return safe(self, output, OMNIDYN_BACKWARDS);
    }
    if (begun && elapsed == 0.0f) {
        for (k = 0; k < OMNIDYN_WHEELS; k++) {
            output[k] = self->last[k];
        }
        return OMNIDYN_STILL;
    }
    why = !sane(pose, 3) ? OMNIDYN_BAD_POSE : !sane(twist, 3) ? OMNIDYN_BAD_TWIST : OMNIDYN_OK;
#if LATE_ROWS
    if (why == OMNIDYN_OK) {
        pose_now(&self->late, elapsed, pose, twist, now);
        pose = now;
    } else {
        self->late.waited += elapsed;
    }
#endif
    if (why != OMNIDYN_OK && begun && elapsed < @LATEST@ && self->missing < @BRIDGED@) { /* the last output again */
        self->missing++;
        for (k = 0; k < OMNIDYN_WHEELS; k++) {
            output[k] = self->last[k];
        }
        return why;
    }
    if (why != OMNIDYN_OK) {
        return safe(self, output, why);
    }
    for (k = 0; k < 3; k++) {
        if (!sane(path[k].pose, 3) || !sane(path[k].velocity, 3)) {
            return safe(self, output, OMNIDYN_BAD_PATH);
        }
    }
    self->missing = 0;
@SWING@    limited = wanted(self, begun ? elapsed : 0.0f, pose, twist, path, output);
    for (k = 0; k < OMNIDYN_WHEELS; k++) {
        if (!(fabsf(output[k]) <= @LARGEST@)) {
            return safe(self, output, OMNIDYN_FAILED);
        }
        output[k] = output[k] > LIMIT[k] ? LIMIT[k] : output[k];
        output[k] = output[k] < -LIMIT[k] ? -LIMIT[k] : output[k];
        self->last[k] = output[k];
    }
    return @SWINGS@limited ? OMNIDYN_LIMITED : OMNIDYN_OK;
}
"""


def is_commanded(law: Any) -> bool:
    """Whether it remembers the sum of a speed loop."""
    return isinstance(law, Pid) and law.output == WHEEL_SPEED
