"""A LeKiwi whose wheels do not turn as asked, the table that says so, and a program for it."""

import numpy as np

import omnidyn
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.logs.wheel_table import WheelLine, WheelTable

LEKIWI = omnidyn.load_robot("lekiwi")
DT = 0.05
GAIN = np.array([[1.02, 0.95, 1.0], [0.78, 0.9, 1.1]])  # forward, backward, of each wheel
BAND = np.array([[0.1, 0.0, 0.2], [0.15, 0.05, 0.0]])  # [rad/s]
ROWS = np.repeat([[0.0, 0.0, 0.0], [1.5, -0.5, -1.0], [0.0, 0.0, 0.0], [-1.5, 0.5, 1.0], [0.0, 0.0, 0.0]], 12, axis=0)


def table_of(gain=GAIN, band=BAND):
    """The table of wheels with these gains and dead bands."""
    wheels = np.shape(gain)[1]
    return WheelTable(
        tuple(
            WheelLine(wheel + 1, 1 - 2 * way, float(gain[way][wheel]), float(band[way][wheel]), 3.0, 0.01)
            for wheel in range(wheels)
            for way in (0, 1)
        )
    )


def corrected(rows):
    """What makes wheels with GAIN and BAND turn with these speeds, by the printed formula turned round."""
    gain, band = (np.where(rows < 0.0, both[1], both[0]) for both in (GAIN, BAND))
    return np.where(rows == 0.0, 0.0, rows / gain + np.sign(rows) * band)


class Worn:
    """A LeKiwi whose wheels turn by GAIN and BAND. A `RobotConnection` that keeps what it was sent."""

    def __init__(self, **options):
        self.robot, self.sent, self.opened = SimulatedRobot(LEKIWI, rate=1.0 / DT, **options), [], 0
        self.clock = self.robot.clock
        self.receive, self.stop, self.close = self.robot.receive, self.robot.stop, self.robot.close

    def open(self):
        self.opened += 1
        self.robot.open()

    def send(self, command):
        self.sent.append(command.inputs)
        asked = np.array(command.inputs)
        gain, band = (np.where(asked < 0.0, both[1], both[0]) for both in (GAIN, BAND))
        turned = np.sign(asked) * gain * np.maximum(np.abs(asked) - band, 0.0)
        self.robot.send(command._replace(inputs=tuple(turned.tolist())))


def program(rows=ROWS, robot=LEKIWI, area=(3.0, 3.0)):
    return DriveProgram(robot, DT, rows, area)
