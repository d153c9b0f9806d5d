"""From a log to motion: a robot that nobody knows, one minute of driving, a model, gains, and what they are worth.

The robot is simulated, so that its truth can be compared with; nothing below `THE ROBOT` knows that truth.
"""

import numpy as np

import omnidyn
from omnidyn.control.controllers import NAMES, ControllerFile
from omnidyn.model.friction import DirectionFriction, Friction

# THE ROBOT: an ellipse of friction, rotors, a current limit, 20 ms until a command acts; warm windings.
table_3 = omnidyn.load_robot("axebot")
body = table_3.body.replace(rotating_frame=True)
ellipse = DirectionFriction(coulomb=(2.6, 1.9), viscous=0.9, yaw_coulomb=0.11, yaw_viscous=0.01)
truth = table_3.replace(
    name="the robot",
    body=body,
    motor=table_3.motor.replace(resistance=1.83, rotor_inertia=1.2e-6, current_limit=2.2),
    friction=Friction(direction=ellipse),
    drive=table_3.drive.replace(latency=0.02),
)

# One minute at 50 Hz: volts on the motors, a new level every half second, and what noisy encoders make of it.
random = np.random.default_rng(1)
volts = np.repeat(random.uniform(-5.5, 5.5, (120, 3)), 25, axis=0)
run = omnidyn.simulate(truth, volts, 0.02)
assert run.wheel_speed is not None
noise = 0.3 * random.standard_normal(run.wheel_speed.shape)
log = run.replace(twist=None, pose=None, current=None, wheel_speed=run.wheel_speed + noise, source="one minute")

# What is known beforehand: the data sheet of the motors, no friction. And a first guess of the shape of friction.
sheet = table_3.replace(
    name="data sheet", body=body, motor=table_3.motor.replace(current_limit=2.2), friction=Friction()
)
guess = sheet.replace(
    motor=sheet.motor.replace(rotor_inertia=1e-6),
    friction=Friction(direction=DirectionFriction(coulomb=(2, 2), viscous=0.5, yaw_coulomb=0.1, yaw_viscous=0.01)),
)
fit = omnidyn.identify(
    [log], guess, omnidyn.OutputError(free=["friction", "motor.resistance_ohm", "motor.rotor_inertia_kg_m2"])
)
model = fit.robot.replace(name="identified")
for name, value in fit.value.items():
    print(f"{name:32} {value:10.4g} +- {fit.std[name]:.1g}")
print(f"latency {1e3 * model.drive.latency:.1f} ms")

# Gains for all the robots that the log allows, then the same controllers on what each model says, driving the robot.
# The path begins at 0.9 m/s: what the robot, at rest, is late by at first is not what is compared.
tuned = omnidyn.tune(model, "eight", "pid", draws=4, evaluations=12, duration=4.0)
print(tuned.verdict)
controllers = {"pid": tuned.controller} | {name: ControllerFile(name) for name in ("mpc",) if name in NAMES}
for name, controller in controllers.items():
    for known in (sheet, table_3, model):
        found = omnidyn.track(known, "eight", controller.make(known), plant=truth, skip=1.5)
        print(f"{name} on {known.name:12} {1e3 * found.rmse_position:8.3f} mm {1e3 * found.rmse_heading:8.3f} mrad")
