"""The ten lines of the README: drive the robot of the paper, and find out when it does not move."""

import omnidyn

robot = omnidyn.load_robot("axebot")  # the robot of the paper; a path loads your own
run = omnidyn.simulate(robot, [[0.0, 3.0, -3.0]] * 1500, 1e-3)  # volts for 3 wheels, 1500 steps of 1 ms
print(repr(run))  # print(run) is a table
print(f"forward at {run.twist[-1, 0]:.4f} m/s after {run.t[-1]:.1f} s, {run.pose[-1, 0]:.4f} m away")
stuck = omnidyn.simulate(robot, [[0.0, 0.6, -0.6]] * 1500, 1e-3)
print("under 0.6 V it stays at", stuck.pose[-1].tolist())
for row in omnidyn.dead_zone(robot).rows:
    print(f"{row.axis} starts to move at {row.scale:.3f} V")
omnidyn.write_run(run, "run.csv")
