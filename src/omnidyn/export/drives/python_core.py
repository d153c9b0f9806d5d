"""The program as a class of Python without any package: used by the node for ROS 2."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.drives.rows import about, cells, constants
from omnidyn.export.spelling import filled, number, python_comment


def python_core(program: DriveProgram) -> str:
    """drive_program.py."""
    data = constants(program)
    pieces = "".join(f"    ({one.rows}, ({cells(one.first)}), ({cells(one.step)})),\n" for one in data.pieces)
    legs = "".join(f"    ({leg.end}, ({cells(leg.angle)})),\n" for leg in data.legs)
    return python_comment(about(program)) + filled(
        _TEXT,
        WHEELS=str(data.wheels),
        DT=number(data.dt),
        DEAD_MAN=number(data.dead_man),
        AREA=f"({cells(data.area)})",
        SUPPLY=number(data.least_supply),
        TWIST=f"({', '.join(f'({cells(row)})' for row in data.to_twist)})",
        PIECES=f"(\n{pieces})",
        LEGS=f"(\n{legs})",
    )


_TEXT = '''"""A program to drive, row by row, with its stops. No ROS, no omnidyn."""

import math

WHEELS = @WHEELS@
DT = @DT@  # [s] of a row
DEAD_MAN = @DEAD_MAN@  # [s] without a measurement, or between two steps, after which it stops
AREA = @AREA@  # [m] free floor along x and y
LEAST_SUPPLY = @SUPPLY@  # [V]
FOLLOWS = 0.2  # of the predicted angle: a wheel that turns less in a leg does not follow
TO_TWIST = @TWIST@  # [axis][wheel]: twist from the speeds of the wheels [rad/s]
PIECES = @PIECES@  # rows, input of the first, from row to row
LEGS = @LEGS@  # row behind a leg, angle that each wheel must turn by in it [rad]; 0 is not judged

WAITING, RUNNING, DONE = 0, 1, 2
RELEASED, LATE, SILENT, LOW_SUPPLY, BORDER, WHEEL = -1, -2, -3, -4, -5, -6
WORDS = {
    WAITING: "waits for the key",
    RUNNING: "drives",
    DONE: "is done",
    RELEASED: "stopped: the key was released",
    LATE: "stopped: the loop was held up",
    SILENT: "stopped: the wheels do not tell their angles",
    LOW_SUPPLY: "stopped: the supply is low",
    BORDER: "stopped: the border of the room",
    WHEEL: "stopped: a wheel does not turn as predicted",
}


class DriveProgram:
    """Call `step` at least ten times a second; it gives the inputs of the wheels. A stop is for good."""

    def __init__(self):
        self.status = WAITING
        self.place = [0.0, 0.0, 0.0]
        self.begun = self.before = self.heard = None
        self.angles = None
        self.leg, self.leg_angles = 0, None
        self.piece, self.piece_row = 0, 0

    def step(self, now, held, angles=None, supply=None):
        """Inputs of the wheels at a time [s]. held: the key. angles: turned since any moment [rad], None where nothing
        new was measured. supply [V]: None where it is not known."""
        if self.status == WAITING and held and angles is not None:
            self.status, self.begun, self.before, self.heard = RUNNING, now, now, now
            self.angles = self.leg_angles = list(angles)
        if self.status != RUNNING:
            return [0.0] * WHEELS
        if not held:
            return self.stop(RELEASED)
        if not 0.0 <= now - self.before <= DEAD_MAN:
            return self.stop(LATE)
        if angles is not None:
            if not self.moved(now, list(angles)):
                return self.stop(BORDER)
        elif now - self.heard > DEAD_MAN:
            return self.stop(SILENT)
        if supply is not None and supply < LEAST_SUPPLY:
            return self.stop(LOW_SUPPLY)
        self.before = now
        row = int((now - self.begun) / DT + 1e-6)
        if not self.follows(row):
            return self.stop(WHEEL)
        return self.inputs(row)

    def stop(self, status):
        """Off, for good."""
        self.status = status
        return [0.0] * WHEELS

    def moved(self, now, angles):
        """Whether it is still inside the room, also when it has come to a stop."""
        turned = [after - before for after, before in zip(angles, self.angles)]
        way = [sum(a * b for a, b in zip(row, turned)) for row in TO_TWIST]
        seconds, self.angles, self.heard = now - self.heard, angles, now
        heading = self.place[2] + 0.5 * way[2]
        dx = math.cos(heading) * way[0] - math.sin(heading) * way[1]
        dy = math.sin(heading) * way[0] + math.cos(heading) * way[1]
        self.place = [self.place[0] + dx, self.place[1] + dy, self.place[2] + way[2]]
        ahead = DEAD_MAN / seconds if seconds > 0.0 else 0.0
        return abs(self.place[0] + ahead * dx) <= 0.5 * AREA[0] and abs(self.place[1] + ahead * dy) <= 0.5 * AREA[1]

    def follows(self, row):
        """Whether the wheels turned as predicted in the legs that are over."""
        while self.leg < len(LEGS) and row >= LEGS[self.leg][0]:
            for wanted, now, before in zip(LEGS[self.leg][1], self.angles, self.leg_angles):
                if wanted != 0.0 and (now - before) / wanted < FOLLOWS:
                    return False
            self.leg, self.leg_angles = self.leg + 1, self.angles
        return True

    def inputs(self, row):
        """The inputs of a row; none behind the last."""
        while self.piece < len(PIECES) and row >= self.piece_row + PIECES[self.piece][0]:
            self.piece_row += PIECES[self.piece][0]
            self.piece += 1
        if self.piece == len(PIECES):
            return self.stop(DONE)
        _, first, slope = PIECES[self.piece]
        return [a + (row - self.piece_row) * b for a, b in zip(first, slope)]
'''
