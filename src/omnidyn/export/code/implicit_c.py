"""The implicit step of one robot in C: its plant as constants, the kernels of the implicit engine, what joins them.

What joins them holds no formula: volts go to the motors, the state is unpacked, moved by `_row` of the march and packed
again. What the robot does not have is known beforehand and falls away: numbers of its plant that are the same in all
records stand in the code, and branches that they decide are left out. Nothing is allocated, and all loops end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.export.code.c_types import INT, REAL, Array, Type, record_type
from omnidyn.export.code.program import CProgram
from omnidyn.export.code.step_c import ALL_WITHIN, StepCode, refusals, volts_code
from omnidyn.export.spelling import SINGLE_MAX, c_number, filled
from omnidyn.model.layout import (
    BODY,
    ELEMENT,
    ELEMENT_STAGE,
    ELEMENT_STATE,
    N_AXES,
    OPEN,
    TASK,
    WORK,
    Plant,
    PlantStage,
    PlantState,
    Stage,
    new_stage,
)
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import with_given_currents
from omnidyn.model.stick_slip.step_bound import MONOTONE
from omnidyn.simulation.implicit.implicit_march import Spare

MARCH = "omnidyn.simulation.implicit.implicit_march"
CHANGING = frozenset(("viscous", "coulomb", "turning"))  # of a bare plant, which solvers change
MOST_STEPS = 300_000  # solved in one call to a tolerance
MOST_PIECES = 100  # of a fixed step, which friction that falls with the speed cuts
# What is rounding in float32: of a residual, a step to a kink, a direction, a root; and an edge that it tells apart.
ROUNDING = {"RESIDUAL_TOLERANCE": 4e-6, "TIE": 1e-5, "FLAT": 1e-5, "ROOT_TOLERANCE": 2e-7, "BAND_EDGE": 1.0 - 1e-6}
RECORDS = {
    "Body": BODY,
    "Element": ELEMENT,
    "Task": TASK,
    "ElementStage": ELEMENT_STAGE,
    "Work": WORK,
    "ElementState": ELEMENT_STATE,
}
KINDS = {name: record_type(name, dtype) for name, dtype in RECORDS.items()}


def implicit_code(robot: Robot, tol: float, single: bool = False) -> StepCode:
    """The step of a robot by the implicit engine; entry: `omnidyn_advance`.

    tol: error [m/s], or 0 for one step a call. single: in float32, which no tolerance suits.
    """
    numbers = plant(robot)
    bare = with_given_currents(numbers) if tol or numbers.body.gathers else None
    rows, stage = len(numbers.element), new_stage(numbers)
    most = MOST_STEPS if tol else MOST_PIECES
    program = CProgram(single, most, ROUNDING if single else {}, _known(numbers, bare))
    call = _translated(program, rows, bare is not None, tol)
    volts = volts_code(program, robot)
    for field in ("voltage", "sign"):
        program.use(KINDS["ElementStage"], field)
    fields = [name for name, _ in KINDS["ElementState"].fields if name in program.used[KINDS["ElementState"]]]
    size = 4 + (rows + 2) * len(fields)
    constants = [("Body", "BODY", [numbers.body]), ("Element", "ELEMENT", numbers.element)]
    constants += [("Task", "TASK", [stage.task]), ("ElementStage", "EACH", stage.each)]
    if bare is not None:
        constants += [("Body", "BARE_BODY", bare.plant.body), ("Element", "BARE_ELEMENT", bare.plant.element[0])]
        constants += [("Task", "BARE_TASK", bare.stage.task), ("ElementStage", "BARE_EACH", bare.stage.each[0])]
    states, steep = _states(bare is not None), numbers.body.steep_sum > 0.0 and not tol
    words = {
        "REAL": program.real,
        "WHEELS": str(robot.wheels.count),
        "ROWS": str(rows),
        "STATES": str(max(states) + 1),
        "MEMORY": str(size),
        "LENGTH": c_number(numbers.body.length, single),
        "LARGEST": c_number(SINGLE_MAX if single else np.finfo(float).max, single),
        "F": "f" if single else "",
        "MOST": str(most),
    }
    text = filled(
        _ADVANCE,
        **words,
        REFUSE=refusals(robot, single),
        SHORT=filled(_SHORT, STEEP=c_number(numbers.body.steep_sum / MONOTONE, single), **words) if steep else "",
        BARE=filled(_BARE, **words) if bare is not None else "",
        BARE_ROW=_BARE_ROW if bare is not None else "",
        SPARE=", ".join([*(f"{{x[{k}], each[{k}]}}" for k in states), "bare" if bare is not None else "0"]),
        UNPACK="\n".join(f"        now.each[e].{name} = {_place(fields, k)};" for k, name in enumerate(fields)),
        PACK="\n".join(f"        {_place(fields, k)} = now.each[e].{name};" for k, name in enumerate(fields)),
        CALL=call,
    )
    parts = [
        program.table("STICKS", np.append(numbers.element["active"], [numbers.body.active, 0.0])),
        program.text(),
        *(program.records(KINDS[kind], name, np.array(values, RECORDS[kind])) for kind, name, values in constants),
        volts,
        filled(ALL_WITHIN, ABS="fabsf" if single else "fabs", REAL=program.real).strip(),
        text.strip(),
    ]
    return StepCode("\n\n".join(parts), robot.wheels.count, "memory", size, lost=False)


def _place(fields: list[str], k: int) -> str:
    """Where memory has a field of a state of element e."""
    return f"memory[4 + {len(fields)} * e + {k}]"


def _states(bare: bool) -> list[int]:
    """The numbers of the states that a Spare has. Without a bare plant, a fixed step works in three."""
    names = [name for name in Spare._fields if name != "bare"]
    return list(range(len(names))) if bare else [{"inner": 1, "now": 2}.get(name, 0) for name in names]


def _known(numbers: Plant, bare: PlantStage | None) -> dict[tuple[str, str], Any]:
    """What is the same in all records of a plant and of its bare one, and which no solver changes."""
    fixed_fields: dict[tuple[str, str], Any] = {("ElementStage", "branch"): OPEN}
    records = {"Body": [numbers.body], "Element": list(numbers.element)}
    if bare is not None:
        records["Body"] += list(bare.plant.body)
        records["Element"] += list(bare.plant.element[0])
    for name, values in records.items():
        for field in RECORDS[name].names or ():
            first = values[0][field]
            constant = bare is None or field not in CHANGING
            if constant and all(np.array_equal(first, record[field]) for record in values):
                fixed_fields[name, field] = float(first) if np.ndim(first) == 0 else np.array(first)
    return fixed_fields


def _translated(program: CProgram, rows: int, bare: bool, tol: float) -> str:
    """Translate a row of the march with all that it calls; its call in C."""
    body, element, task, each, work, state = KINDS.values()
    one = program.struct(Plant, body, Array((rows,), element))
    stage = program.struct(Stage, task, Array((rows,), each), work)
    states = program.struct(PlantState, Array((N_AXES,)), Array((rows + 2,), state))
    room: Type = REAL
    if bare:
        plants = program.struct(Plant, Array((1,), body), Array((1, rows), element))
        room = program.struct(
            PlantStage, plants, program.struct(Stage, Array((1,), task), Array((1, rows), each), Array((1,), work))
        )
    spare = program.struct(Spare, *[states] * (len(Spare._fields) - 1), room)
    numbers = Array((3,)), Array((3,), INT)
    if not tol:
        name = program.translated(MARCH, "_fixed_row", one, stage, spare, states, REAL, *numbers)
        return f"{name}(plant, stage, spare, now, h, place, counts)"
    name = program.translated(MARCH, "_row", one, stage, room, spare, states, *[REAL] * 4, *numbers)
    return f"trial = {name}(plant, stage, bare, spare, now, h, {c_number(tol)}, {MOST_STEPS}, trial, place, counts)"


_SHORT = """
    if (h * @STEEP@ > @MOST@) {
        return OMNIDYN_STEP_TOO_LONG;
    }"""

_BARE = """
    Body bare_body[1] = {BARE_BODY[0]};
    Element bare_element[1][@ROWS@];
    Task bare_task[1] = {BARE_TASK[0]};
    ElementStage bare_each[1][@ROWS@];
    Work bare_work[1] = {0};
    const PlantStage bare = {{bare_body, bare_element}, {bare_task, bare_each, bare_work}};"""

_BARE_ROW = """
        bare_element[0][e] = BARE_ELEMENT[e];
        bare_each[0][e] = BARE_EACH[e];"""

_ADVANCE = """
/* Move the state by h [s], or say why not. memory: the speeds left behind, the next length to try, what sticks. */
static int omnidyn_advance(const @REAL@ u[], @REAL@ h, @REAL@ twist[3], @REAL@ pose[3], @REAL@ memory[@MEMORY@])
{
    @REAL@ x[@STATES@][3] = {0}, place[3], trial = memory[3] > 0 ? memory[3] : h;
    ElementState each[@STATES@][@ROWS@ + 2] = {0};
    Task task = TASK[0];
    ElementStage elements[@ROWS@];
    Work work = {0};@BARE@
    const Plant plant = {(Body *)BODY, (Element *)ELEMENT}; /* into which no solver writes */
    const Stage stage = {&task, elements, &work};
    const Spare spare = {@SPARE@};
    const PlantState now = spare.now;
    int e, counts[3] = {0};
@REFUSE@
    if (!all_within(memory, @MEMORY@, @LARGEST@)) {
        return OMNIDYN_STEP_BAD_FORCE;
    }@SHORT@
    for (e = 0; e < @ROWS@; e++) {
        elements[e] = EACH[e];@BARE_ROW@
    }
    for (e = 0; e < @WHEELS@; e++) {
        elements[3 + e].voltage = reaching(u[e], e);
    }
    for (e = 0; e < 3; e++) {
        now.x[e] = e < 2 ? twist[e] : twist[e] * @LENGTH@;
        place[e] = pose[e];
    }
    for (e = 0; e < @ROWS@ + 2; e++) {
@UNPACK@
    }
    if (twist[0] != memory[0] || twist[1] != memory[1] || twist[2] != memory[2]) { /* not what a step left */
        for (e = 0; e < @ROWS@; e++) {
            const @REAL@ *g = ELEMENT[e].g;
            now.each[e].sign = g[0] * now.x[0] + g[1] * now.x[1] + g[2] * now.x[2];
        }
        now.each[@ROWS@].sign = now.x[0] != 0 || now.x[1] != 0;
    }
    for (e = 0; e < @STATES@; e++) {
        each[e][@ROWS@ + 1].sign = 2; /* that nothing has */
    }
    for (e = 0; e < @ROWS@ + 2; e++) {
        const @REAL@ sign = now.each[e].sign;
        now.each[e].sign = STICKS[e] == 0 ? 2 : sign == 0 ? 0 : copysign@F@(1, sign);
    }
    @CALL@;
    now.x[2] /= @LENGTH@;
    if (counts[1] > @MOST@ || !all_within(now.x, 3, @LARGEST@) || !all_within(place, 3, @LARGEST@)) {
        return OMNIDYN_STEP_TOO_LONG;
    }
    for (e = 0; e < 3; e++) {
        memory[e] = twist[e] = now.x[e];
        pose[e] = place[e];
    }
    memory[3] = trial;
    for (e = 0; e < @ROWS@ + 2; e++) {
@PACK@
    }
    return OMNIDYN_STEP_OK;
}
"""
