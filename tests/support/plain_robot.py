"""A robot of three omni wheels in plain NumPy: nothing of omnidyn moves it. Logs of it with known numbers."""

import numpy as np

import omnidyn

ROW, SUBSTEPS = 0.02, 20
OHM, CONSTANT, GEAR, ARM, RADIUS, MASS = 1.7, 0.006, 19.0, 0.12, 0.0519, 3.0
INERTIA = 0.5 * MASS * ARM**2
VISCOUS, COULOMB = np.array([1.2, 1.0, 0.012]), np.array([2.5, 2.0, 0.12])
AZIMUTH = np.radians([180.0, -60.0, 60.0])
WRENCH = np.stack([-np.sin(AZIMUTH), np.cos(AZIMUTH), np.full(3, ARM)])  # of a push of 1 N at each wheel
NOISE = 0.05  # [rad/s] of wheel speeds

FILE = """schema = 1
name = "plain"
[body]
mass_kg = {mass}
inertia_kg_m2 = {inertia}
[wheels]
azimuth_deg = [180.0, -60.0, 60.0]
robot_radius_m = {arm}
wheel_radius_m = {radius}
[motor]
resistance_ohm = {ohm}
torque_constant_Nm_A = {constant}
emf_constant_Vs_rad = {constant}
gear_ratio = {gear}
voltage_limit_V = 6.0
[friction.axes]
viscous = [1.0, 1.0, 0.01]
coulomb = [2.0, 2.0, 0.1]
"""


def robot(folder, *, radius=RADIUS, inertia=INERTIA):
    """The robot file as a user has it, friction roughly guessed."""
    path = folder / "plain.toml"
    numbers = {"mass": MASS, "arm": ARM, "ohm": OHM, "constant": CONSTANT, "gear": GEAR}
    path.write_text(FILE.format(**numbers, radius=radius, inertia=inertia))
    return omnidyn.load_robot(path)


def log(seed, *, late_rows=0, push=(0.0, 0.0, 0.0), dead_band=0.0, levels=20, held=40, still=25, coulomb=COULOMB):
    """A Run of wheel speeds under random levels of voltage, from rest. push [N, N, N m]: a constant force.
    dead_band [V]: of the driver, which takes so much off each voltage."""
    rng = np.random.default_rng(seed)
    volts = np.concatenate([np.zeros((still, 3)), np.repeat(rng.uniform(-6.0, 6.0, (levels, 3)), held, axis=0)])
    acting = np.concatenate([np.zeros((late_rows, 3)), volts])[: len(volts)]
    reaching = np.sign(acting) * np.maximum(np.abs(acting) - dead_band, 0.0)
    twist = moved(reaching, np.asarray(push), coulomb)
    speeds = twist @ WRENCH / RADIUS + NOISE * rng.standard_normal(twist.shape)
    return omnidyn.Run(t=np.arange(len(volts)) * ROW, voltage=volts, wheel_speed=speeds)


def moved(volts, push, coulomb=COULOMB):
    """The twist at each row, (rows, 3): dry friction takes what would stop the mass within a step, up to its level."""
    step, mass = ROW / SUBSTEPS, np.array([MASS, MASS, INERTIA])
    gain, emf = CONSTANT * GEAR / (OHM * RADIUS), CONSTANT * GEAR / RADIUS
    drag, v, found = gain * emf * WRENCH @ WRENCH.T + np.diag(VISCOUS), np.zeros(3), np.zeros((len(volts), 3))
    for k, drive in enumerate(gain * volts @ WRENCH.T + push):
        found[k] = v
        for _ in range(SUBSTEPS):
            stop = v * mass / step + drive - drag @ v
            v = (stop - np.clip(stop, -coulomb, coulomb)) * step / mass
    return found
