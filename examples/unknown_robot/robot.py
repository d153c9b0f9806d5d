"""A robot that nobody knows, with NumPy alone: it shares no code with omnidyn, and no model there holds it exactly.

    python robot.py plan.csv log.csv

plays a program of duties from rest, and writes what a robot would log. What is true of it stands below, and is wrong in
every robot file: friction that falls with speed and is smooth near rest, a floor that is not even, four motors that
differ, a battery that gives way, duties in 255 steps that come late and through a lag, a camera that is late.
"""

import sys

import numpy as np

MASS, INERTIA = 4.2, 0.068  # [kg], [kg m²]
RADIUS, ARM, ANGLES = 0.04, 0.17, np.radians([45, 135, 225, 315])  # [m], [m], of the wheels around the robot
RESISTANCE, CONSTANT, GEAR, ROTOR = 1.9, 0.0105, 30.0, 9.0e-7  # [ohm], [N m/A] and [V s/rad], -, [kg m²]
MOTORS = np.array([1.01, 0.985, 1.0, 1.005])  # torque of each motor, as a share
COULOMB, TURNING = 5.6, 0.55  # [N], [N m] at speed
STRIBECK, FADES = 0.1, np.array([0.04, 0.04, 0.25])  # so much more near rest, until [m/s, m/s, rad/s]
SMOOTH = np.array([1e-3, 1e-3, 6e-3])  # [m/s, m/s, rad/s]: below, friction is no step
VISCOUS = np.array([3.1, 3.1, 0.06])  # [N s/m, N s/m, N m s]
SLOPE, WAVE = 0.002, 0.9  # of the floor, up and down; [m] from hill to hill
BATTERY, INNER = 11.8, 0.05  # [V], [ohm]
STEPS, LATE, LAG = 255, 0.012, 0.004  # of a duty; [s] until it arrives; [s] of what smooths it
COUNTS = 2048  # a turn of a wheel
CAMERA, CAMERA_LATE, CAMERA_NOISE = 0.04, 0.06, np.array([1e-3, 1e-3, 3e-3])  # [s], [s], [m, m, rad]
ROW, STEP = 0.01, 0.0005  # [s] between two rows of a log, of the simulation

RIM = np.column_stack([-np.sin(ANGLES), np.cos(ANGLES), np.full(4, ARM)])  # speeds of the rims = RIM @ (vx, vy, omega)
PUSH = CONSTANT * GEAR / RADIUS  # [N/A] of a motor at the rim, [V s/m]
INERT = np.array([MASS, MASS, INERTIA]) + (GEAR / RADIUS) ** 2 * ROTOR * np.diag(RIM.T @ RIM)  # with the rotors
COLUMNS = "time_s,duty1,duty2,duty3,duty4,battery_V,ticks1,ticks2,ticks3,ticks4,x_m,y_m,yaw_rad"


class Robot:
    """It stands in the middle of the room, and goes on by `step`."""

    def __init__(self, seed=0):
        self.rng = np.random.default_rng(seed)
        self.time, self.steps = 0.0, 0
        self.twist, self.pose, self.angle = np.zeros(3), np.zeros(3), np.zeros(4)
        self.duty, self.volts, self.battery = np.zeros(4), np.zeros(4), BATTERY
        self.underway = [np.zeros(4)] * round(LATE / STEP)
        self.poses = [self.pose] * round(CAMERA_LATE / STEP)

    def step(self, duty, seconds=ROW):
        """Drive with a duty of each motor, -1 to 1, for a while."""
        asked = np.round(np.clip(duty, -1.0, 1.0) * STEPS) / STEPS
        for _ in range(round(seconds / STEP)):
            self.underway.append(asked)
            self._move(self.underway.pop(0))
            self.poses.append(self.pose)
            self.steps += 1
        self.time = self.steps * STEP
        del self.poses[: -round(CAMERA_LATE / STEP) - 1]

    def _move(self, duty):
        self.duty = self.duty + STEP / LAG * (duty - self.duty)
        twist, (_, _, yaw) = self.twist, self.pose
        current = (self.duty * self.battery - PUSH * (RIM @ twist)) / RESISTANCE
        self.battery = BATTERY - INNER * float(np.abs(self.duty * current).sum())
        force = (PUSH * MOTORS * current) @ RIM - VISCOUS * twist
        force += MASS * twist[2] * np.array([twist[1], -twist[0], 0.0])  # the frame turns
        cosine, sine = np.cos(yaw), np.sin(yaw)
        room = np.array([[cosine, -sine], [sine, cosine]])
        force[:2] -= MASS * 9.81 * SLOPE * np.sin(2.0 * np.pi / WAVE * self.pose[:2] + (1.0, 2.0)) @ room
        travel = np.hypot(twist[0], twist[1])
        speed = np.array([travel, travel, abs(twist[2])])
        dry = np.array([COULOMB, COULOMB, TURNING]) * (1.0 + STRIBECK * np.exp(-((speed / FADES) ** 2)))
        self.twist = (INERT * twist + STEP * force) / (INERT + STEP * dry / np.hypot(speed, SMOOTH))
        self.angle = self.angle + STEP * (RIM @ self.twist) / RADIUS
        self.pose = self.pose + STEP * np.concatenate([room @ self.twist[:2], self.twist[2:]])

    def measure(self):
        """Battery [V], counts of four encoders, and now and then where a camera saw it [m, m, rad], else None."""
        battery = np.round((self.battery + 0.02 * self.rng.standard_normal()) / 0.05) * 0.05
        counts = np.floor(self.angle * COUNTS / (2.0 * np.pi)).astype(int)
        seen = None
        if self.steps % round(CAMERA / STEP) == 0:
            seen = np.round(self.poses[0] + CAMERA_NOISE * self.rng.standard_normal(3), 4)
        return float(battery), counts, seen


def play(program, log):
    """Drive the rows of a program, and write a log; its name is the seed of the noise."""
    rows = np.loadtxt(program, delimiter=",", skiprows=1, ndmin=2)
    robot = Robot(sum(log.encode()))
    with open(log, "w", encoding="utf-8", newline="\n") as file:
        file.write(COLUMNS + "\n")
        for duty in np.concatenate([rows[:, 1:5], np.zeros((50, 4))]):
            battery, counts, seen = robot.measure()
            pose = ["", "", ""] if seen is None else [f"{value:.4f}" for value in seen]
            cells = [f"{robot.time:.2f}", *(f"{value:.4f}" for value in duty), f"{battery:.2f}", *map(str, counts)]
            file.write(",".join(cells + pose) + "\n")
            robot.step(duty)
    print(f"{robot.time:.1f} s driven, to {log}; it stands at {np.round(robot.pose, 2).tolist()}")


if __name__ == "__main__":
    play(sys.argv[1], sys.argv[2])
