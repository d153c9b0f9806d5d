"""Makes drive1.csv to drive3.csv: a robot with four wheels, simulated with NumPy alone, so that what omnidyn finds can
be compared with what is true. Its friction near rest is smooth, which no model of omnidyn holds exactly.

    python make.py
"""

import numpy as np

MASS, INERTIA = 4.2, 0.075  # [kg], [kg m²]
RADIUS, ARM, ANGLES = 0.04, 0.17, np.radians([45, 135, 225, 315])  # [m], [m], of the wheels around the robot
RESISTANCE, CONSTANT, GEAR, ROTOR = 1.9, 0.0105, 30.0, 9.0e-7  # [ohm], [N m/A] and [V s/rad], -, [kg m²]
COULOMB, VISCOUS = (
    np.array([5.6, 5.6, 0.55]),
    np.array([3.1, 3.1, 0.06]),
)  # along x and y [N], in turning [N m]; N s/m, N m s
BATTERY, LATE, COUNTS = 11.8, 0.012, 2048  # [V]; [s] until a duty arrives; a turn of a wheel
ROW, STEP = 0.01, 0.0002  # [s] between two rows of the log, of the simulation

RIM = np.column_stack([-np.sin(ANGLES), np.cos(ANGLES), np.full(4, ARM)])  # speeds of the rims = RIM @ (vx, vy, omega)


def duties(seconds, rng):
    """A duty for each wheel and row: levels of .1 to 1.5 s, one in six of them a stop; it begins and ends at rest."""
    rows, duty = round(seconds / ROW), np.zeros((round(seconds / ROW), 4))
    row = 100
    while row < rows - 100:
        length = int(rng.integers(10, 150))
        twist = rng.uniform(-1.0, 1.0, 3) * rng.uniform(0.2, 1.0) * (rng.random() < 5 / 6)
        duty[row : row + length] = np.clip(RIM @ (twist * (1.0, 1.0, 4.0)), -1.0, 1.0)
        row += length
    duty[-100:] = 0.0
    return duty.round(3)


def turned_by(duty):
    """How far each wheel has turned at each row [rad]."""
    late, a_row = round(LATE / STEP), round(ROW / STEP)
    volts = np.vstack([np.zeros((late, 4)), np.repeat(duty, a_row, axis=0)])[: len(duty) * a_row] * BATTERY
    mass = np.diag([MASS, MASS, INERTIA]) + (GEAR / RADIUS) ** 2 * ROTOR * RIM.T @ RIM
    twist, angle, logged = np.zeros(3), np.zeros(4), [np.zeros(4)]
    for k, u in enumerate(volts, 1):
        current = (u - CONSTANT * GEAR / RADIUS * (RIM @ twist)) / RESISTANCE
        force = RIM.T @ (CONSTANT * GEAR / RADIUS * current) - VISCOUS * twist
        force += MASS * twist[2] * np.array([twist[1], -twist[0], 0.0])  # the frame turns
        travel = np.array([np.hypot(twist[0], twist[1])] * 2 + [abs(twist[2])])
        dry = np.diag(COULOMB / np.hypot(travel, (1e-3, 1e-3, 1e-2)))
        twist = np.linalg.solve(mass + STEP * dry, mass @ twist + STEP * force)
        angle = angle + STEP * (RIM @ twist) / RADIUS
        if k % a_row == 0:
            logged.append(angle)
    return np.array(logged)


def main():
    for number, seconds in enumerate((40.0, 40.0, 20.0), 1):
        duty = duties(seconds, np.random.default_rng(number))
        ticks = np.floor(turned_by(duty) * COUNTS / (2.0 * np.pi)).astype(int)
        with open(f"drive{number}.csv", "w", encoding="utf-8", newline="\n") as file:
            file.write("time_s,duty1,duty2,duty3,duty4,battery_V,ticks1,ticks2,ticks3,ticks4\n")
            for k, (d, a) in enumerate(zip(np.vstack([duty, duty[-1:]]), ticks, strict=True)):
                file.write(",".join([f"{k * ROW:.2f}", *(f"{x:g}" for x in d), f"{BATTERY}", *map(str, a)]) + "\n")


if __name__ == "__main__":
    main()
