"""The named parts that the compiled solvers work in: constants of a robot, the state of a run, a stage of a step.

    plant.body.mass, plant.element[e].coulomb[side]      constants: a Plant. No solver writes into one that it is given
    state.x[a], state.each[e].sign, .current, .bend      the PlantState of a run
    stage.task.tau, stage.each[e].sign                   the problem of one stage, and what its solution leaves
    stage.work.jacobian[a, b]                            room to work in

Yaw is measured as length, rho = sqrt(I/M) of the body, so that the body has the mass M in all directions and all
forces are in newtons. What spins adds its own mass, which couples the directions where wheels differ, and so does a
centre of mass that stands off.
An element is where dry friction acts on one scalar speed: rows 0..2 are the body axes, 3.. the wheels. The ellipse of
the direction of travel acts on (v_x, v_y) as a whole: what it needs stands in `body` and `task`. Pairs of levels are
against forward and against backward motion; of the ellipse, along x and along y.

Each part is a NumPy record, or an array of them. In a kernel a record is one pointer, its fields are constant offsets,
so that a part is cheap to hand on; the plants of many robots are one longer array. (Tried on the kernel of
`accelerations`: named tuples of one array for each field took 2.5 times as long to compile, 19 s against 7.5 s, and 1.6
times as long to solve. Tables with numbered columns took as long as records do.)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

N_AXES, YAW = 3, 2  # the first rows are the body axes; the row of yaw
OPEN = 0.0  # branch of a current that is still to be found


def record(**fields: Any) -> np.dtype[Any]:
    """The type of a part: its fields with their shapes, () for one number."""
    return np.dtype((np.record, np.dtype([(name, "f8", shape) for name, shape in fields.items()], align=True)))


BODY = record(
    mass=(),  # M of the body [kg]
    least=(),  # [kg] the least that any direction has: M, but where the centre of mass stands off
    spin=(3, 3),  # [kg] what rotors and wheels, and a centre that stands off, add to M in all directions
    centre=(2,),  # of mass, from that of the wheels, in rho
    length=(),  # rho [m]
    turning=(),  # M/rho where the body frame turns, else 0
    room=(2,),  # [N] constant force on the centre of mass along x and y of the room
    push=(3,),  # [N] constant wrench on the body, in its own axes
    active=(),  # 1 where there is an ellipse
    plain=(),  # 1 where its force is (Cx vx, Cy vy)/|v|, not that of maximum dissipation
    coulomb=(2,),  # of the ellipse [N]
    breakaway=(2,),  # [N]
    fall=(),  # the rest of the ellipse as of an element; its bristle bends along x and y
    form=(),
    exponent=(),
    law=(),
    stiffness=(),
    damping=(),
    fade=(),
    dahl_exponent=(),
    elastic=(),
    bristle_coulomb=(2,),
    bristle_breakaway=(2,),
    memory=(2,),  # [s] in which the slowest motion fades to 1/e, dry friction apart; and where motors let go
    laws=(),  # 0 where no level depends on the speed and nothing has a memory: then what follows is not read
    steep=(),  # [1/s] bound of the rate at which friction that falls with the speed lets a body run away: the ellipse
    steep_sum=(),  # and all friction together
    bristles=(),  # the sum of the levels of all bristles [N]; 0 where there are none
    off=(),  # 1 where the centre of mass stands off
    band=(),  # Karnopp's speed of the ellipse [m/s], 0 for none
    gathers=(),  # 1 where all that rests gathers momentum in Karnopp's band, 2 where something else can stick too
)
ELEMENT = record(
    g=(3,),  # local speed = g . x
    viscous=(),  # [N s/m]
    coulomb=(2,),  # [N]
    breakaway=(2,),  # [N]
    active=(),  # 1 when the element can stick
    fall=(),  # Stribeck: 1/speed [s/m], 0 where the level does not fall
    form=(),  # the number of its shape, and its exponent: stribeck.py
    exponent=(),
    law=(),  # the number of the law of its bristle: bristle.py
    stiffness=(),  # of a bristle [N/m], 0 where there is none
    damping=(),  # [N s/m]
    fade=(),  # 1/speed [s/m] at which the damping fades, 0 where it does not
    dahl_exponent=(),
    elastic=(),  # share of its bend up to which a bristle is a spring
    bristle_coulomb=(2,),  # levels of a bristle [N], as `coulomb` and `breakaway` are of what sticks
    bristle_breakaway=(2,),
    steep=(),  # as of the ellipse
    band=(),  # Karnopp's speed [m/s], 0 for none
    thrust=(),  # of a motor, at the rim of its wheel: force per ampere [N/A]
    emf=(),  # back-EMF [V s/m]
    resistance=(),
    inductance=(),
    drop=(),
    limit=(),
    efficiency=(),  # of its gear
)
TASK = record(
    tau=(),  # length of the stage [s]
    goal=(3,),  # x* [m/s]
    push=(3,),  # wrench from outside [N]
    facing=(),  # heading at the start of a step [rad]
    ellipse=(),  # 1 slides, 0 stuck, 2 there is none
    hold=(2,),  # what the ellipse holds at rest [N]
    aimed_bend=(2,),  # z* of its bristle [m]
    bend=(2,),  # and z at the solution
)
ELEMENT_STAGE = record(
    sign=(),  # 1 and -1 slide forward and backward, 0 stuck, 2 no dry friction
    hold=(2,),  # what it holds at rest [N]
    loss=(2,),  # gear loss at rest [N]
    voltage=(),  # applied [V]
    bound=(),  # current limit in force [A]
    aimed_current=(),  # i* [A]
    current=(),  # i at the solution [A]
    branch=(),  # of the current, as winding_branch tells it; OPEN: found at the solution
    aimed_bend=(),  # z* [m]
    bend=(),  # z at the solution
    found=(),  # marks of the solver
    before=(),
)
ELEMENT_STATE = record(
    sign=(),  # as in ELEMENT_STAGE
    current=(),  # of a motor [A]
    bend=(),  # z of a bristle [m]; of a body axis, where anything gathers, the speed gathered along it [m/s]
)
WORK = record(
    residual=(3,),  # (M/tau)(x - x*) minus all forces but those of stuck elements [N]
    jacobian=(3, 3),  # its slopes by x
    close=(3,),  # how much of it is rounding
    first=(3,),  # that of the first stage of a step, where momentum gathers in Karnopp's bands
    newton=(3,),  # Newton's step
    trial=(3,),  # a point on the way
    worst=(3,),  # direction in which what is stuck holds least
    basis=(3, 3),  # rows: the velocities that what is stuck allows
    row=(3, 3),  # Gauss-Jordan rows of what it forbids
    pivot=(3,),
    spare=(3,),
    matrix=(3, 4),  # of Newton's step within the active set
)


class Plant(NamedTuple):
    """The constants of a robot. body: a record BODY; element: shape (3 + wheels,), of ELEMENT.

    Of many robots: one more axis in front.
    """

    body: Any
    element: Any

    @property
    def wheels(self) -> int:
        """Number of wheels."""
        return self.element.shape[-1] - N_AXES

    def copy(self) -> Plant:
        """The same numbers in arrays of their own."""
        return Plant(self.body.copy(), self.element.copy())


class PlantState(NamedTuple):
    """The state of a run. x: (3,) [m/s]; each: shape (3 + wheels + 2,), of ELEMENT_STATE.

    Behind the elements stands the ellipse, along x and along y; its sign is in the first of the two. Of many instants,
    or robots: one more axis in front.
    """

    x: Any
    each: Any

    def at(self, rows: Any) -> PlantState:
        """The state, or the states, of some of many."""
        return PlantState(*(part[rows] for part in self))


class Stage(NamedTuple):
    """A stage of a step: task, a record TASK; each, shape (3 + wheels,), of ELEMENT_STAGE; work, a record WORK."""

    task: Any
    each: Any
    work: Any


class PlantStage(NamedTuple):
    """A plant and a stage of it."""

    plant: Plant
    stage: Stage

    def copy(self) -> PlantStage:
        """The same numbers in arrays of their own."""
        return PlantStage(self.plant.copy(), Stage(*(part.copy() for part in self.stage)))


def blank_plant(wheels: int) -> Plant:
    """A plant of zeros."""
    return Plant(np.zeros(1, BODY)[0], np.zeros(N_AXES + wheels, ELEMENT))


def many(plants: Sequence[Plant]) -> Plant:
    """Plants of as many elements each, as one. Python hands arrays of records to a kernel, and be it of one: a record
    takes it twenty times as long."""
    return Plant(
        np.array([plant.body for plant in plants], BODY), np.array([plant.element for plant in plants], ELEMENT)
    )


def new_states(plant: Plant, count: int) -> PlantState:
    """So many states of rest of one plant, without currents: all that can stick is stuck."""
    body, element = plant
    states = PlantState(np.zeros((count, 3)), np.zeros((count, len(element) + 2), ELEMENT_STATE))
    states.each["sign"] = 2.0 - 2.0 * np.concatenate([element["active"], [body.active, 0.0]])
    return states


def new_state(plant: Plant) -> PlantState:
    """One of them."""
    return new_states(plant, 1).at(0)


def new_stage(plant: Plant) -> Stage:
    """A stage of a plant: all that can stick is stuck, nothing drives; of many plants, as many stages."""
    stage = Stage(
        np.zeros(plant.body.shape, TASK)[()],
        np.zeros(plant.element.shape, ELEMENT_STAGE),
        np.zeros(plant.body.shape, WORK)[()],
    )
    body, element = plant
    stage.task["ellipse"], stage.each["sign"] = 2.0 - 2.0 * body["active"], 2.0 - 2.0 * element["active"]
    stage.task["hold"], stage.each["hold"], stage.each["bound"] = (
        body["breakaway"],
        element["breakaway"],
        element["limit"],
    )
    return stage
