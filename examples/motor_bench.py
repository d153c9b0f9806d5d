"""A motor on a bench: slow ramps from rest, up and down, both ways; then where it starts, and what each speed needs.

The motor is simulated by small steps. It rests up to 0.6 V forward and 0.9 V backward, slides at less, and has a drag
that grows with the square of the speed: the line of input over speed bends, and meets speed 0 where nothing starts.
"""

import numpy as np

import omnidyn

HOLD, SLIDE, SLOPE, DRAG, INERTIA = (0.6, 0.9), (0.4, 0.55), 0.3, 0.02, 0.02  # V; V s/rad, V s2/rad2
RATE, FINE = 0.01, 10  # s; small steps in a row


def step(w, u, dt):
    """The speed [rad/s] after dt: INERTIA w' = u - SLOPE w - DRAG w |w| - SLIDE sgn w; at rest up to HOLD."""
    side = np.sign(w) if w else float(u > HOLD[0]) - float(u < -HOLD[1])
    if not side:
        return 0.0
    after = w + dt / INERTIA * (u - SLOPE * w - DRAG * w * abs(w) - side * SLIDE[0 if side > 0 else 1])
    return after if after * side > 0 else 0.0


up = np.arange(0.0, 3.0, 0.8 * RATE)
ramps = [np.concatenate([np.zeros(30), way * up, way * up[::-1]]) for way in (1, -1, 1, -1)]
voltage = np.concatenate(ramps)
speed = np.zeros(len(voltage))
for row, u in enumerate(voltage[:-1]):
    speed[row + 1] = speed[row]
    for _ in range(FINE):
        speed[row + 1] = step(speed[row + 1], u, RATE / FINE)
speed += 0.05 * np.random.default_rng(0).standard_normal(len(speed))

run = omnidyn.Run(t=RATE * np.arange(len(voltage)), voltage=voltage[:, None], wheel_speed=speed[:, None])
omnidyn.write_run(run, "bench.csv", force=True)
study = omnidyn.identify(run, None, omnidyn.MotorLine())
print(study.verdict)
study.plot().savefig("motors.png", dpi=150)
