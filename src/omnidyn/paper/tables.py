"""The numbers the paper prints, typed once, with their place. Nothing here is computed.

M. Dourado Correia, A. G. S. Conceicao, "Modeling of a Three Wheeled Omnidirectional Robot Including Friction
Models", 10th IFAC Symposium on Robot Control, 2012. The project works from a transcription of the paper (equations,
tables, some sentences), not from its pages: every number below is as transcribed. The data behind the figures are not
in it, and of Figs. 1 and 3 it holds nothing. Axes are x, y, yaw: the paper's v, v_n, w.
"""

from __future__ import annotations

from dataclasses import dataclass

PAPER_AXES = {"x": "v", "y": "v_n", "yaw": "w"}
SPEED_UNIT = {"x": "m/s", "y": "m/s", "yaw": "rad/s"}
FORCE_UNIT = {"x": "N", "y": "N", "yaw": "N m"}

Three = tuple[float, float, float]


@dataclass(frozen=True)
class SteadyRow:
    """One row of Table 1: voltage [V] of the motors, speed [m/s, yaw rad/s] and force [N, yaw N m] along one axis."""

    voltage: Three
    speed: float
    force: float

    @property
    def at_rest(self) -> bool:
        """Whether the robot is printed as not moving."""
        return self.speed == 0.0


TABLE_1: dict[str, tuple[SteadyRow, ...]] = {
    "x": (
        SteadyRow((0.0, 1.2, -1.2), 0.0, 2.25),
        SteadyRow((0.0, 2.0, -2.0), 0.37, 2.48),
        SteadyRow((0.0, 3.0, -3.0), 0.74, 2.79),
        SteadyRow((0.0, 4.0, -4.0), 1.08, 3.28),
    ),
    "y": (
        SteadyRow((-1.5, 0.75, 0.75), 0.0, 1.47),
        SteadyRow((-3.0, 1.5, 1.5), 0.42, 1.97),
        SteadyRow((-4.0, 2.0, 2.0), 0.75, 2.33),
        SteadyRow((-5.0, 2.5, 2.5), 1.08, 2.49),
    ),
    "yaw": (
        SteadyRow((0.25, 0.25, 0.25), 0.0, 0.10),
        SteadyRow((1.5, 1.5, 1.5), 5.84, 0.14),
        SteadyRow((2.0, 2.0, 2.0), 8.04, 0.18),
        SteadyRow((2.5, 2.5, 2.5), 10.02, 0.21),
    ),
}
"""Table 1: steady voltage, speed and force, four rows per axis; the first of each is printed at rest."""

TABLE_2_VISCOUS: Three = (0.94, 0.96, 0.01)
"""Table 2: B_v [N s/m], B_vn [N s/m], B_w [N m s]."""
TABLE_2_COULOMB: Three = (2.2, 1.5, 0.099)
"""Table 2: C_v [N], C_vn [N], C_w [N m]."""

TABLE_3: dict[str, float] = {
    "body.mass_kg": 1.5,
    "body.inertia_kg_m2": 0.025,
    "wheels.robot_radius_m": 0.1,
    "wheels.wheel_radius_m": 0.035,
    "motor.resistance_ohm": 1.69,
    "motor.inductance_H": 0.00011,
    "motor.torque_constant_Nm_A": 0.0059,
    "motor.emf_constant_Vs_rad": 0.0059,
    "motor.gear_ratio": 19.0,
    "motor.voltage_limit_V": 6.0,
    "friction.axes.viscous[0]": 0.94,
    "friction.axes.viscous[1]": 0.96,
    "friction.axes.viscous[2]": 0.01,
    "friction.axes.coulomb[0]": 2.2,
    "friction.axes.coulomb[1]": 1.5,
    "friction.axes.coulomb[2]": 0.099,
}
"""Table 3: the parameters in SI, by their key in a robot file. i_max of (12) has no value there."""
TABLE_3_UNIT_OF_B_W = "N/(rad/s)"
"""Table 3: the unit printed beside B_w."""
INERTIA_SENTENCE = "a cylinder of the robot's dimensions"
"""The paper's words for where I_n comes from."""

TABLE_4: dict[str, tuple[Three, ...]] = {
    "x": ((0.0, 2.0, -2.0), (0.0, 3.0, -3.0), (0.0, 4.0, -4.0)),
    "y": ((-2.0, 1.0, 1.0), (-3.0, 1.5, 1.5), (-4.0, 2.0, 2.0)),
    "yaw": ((2.0, 2.0, 2.0), (3.0, 3.0, 3.0), (4.0, 4.0, 4.0)),
}
"""Table 4: the nine voltage steps [V] of the validation, three per axis."""

EQ_3: tuple[Three, Three, Three] = (
    (0.0, 3.0**0.5 / 3.0, -(3.0**0.5) / 3.0),
    (2.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0),
    (1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0),
)
"""Eq (3) as printed: rows v and v_n times r, row w times r/b; columns are the wheels. See the claim on its sign."""
EQ_11_POWER_OF_GEAR = 0
"""Eq (11): the back-EMF is printed K_v w_m; w_m is the speed of the wheel in (3)."""
EQ_12 = "0 <= i <= i_max"
"""Eq (12) as printed."""
EQ_13_POWER_OF_GEAR = {"A": 2, "B": 1}
"""Eq (13): the power of the gear ratio l that is printed in the motor's part of A, and in B."""
EQ_13_SYMBOLS_OF_A33 = ("J", "I_n")
"""Eq (13): A_33 is printed with both symbols; Table 3 has a value for I_n only."""

DEAD_ZONE_TEXT: dict[str, float] = {"x": 1.0, "y": 1.0, "yaw": 0.3}
"""Section 4, Fig. 5: the dead zones are about this many volts."""
FIG_2_VOLTAGE, FIG_2_SPEED = 3.0, 0.74
"""Fig. 2: 3 V give about 0.74 m/s (the one number the transcription has of Fig. 2)."""
NOISE_SENTENCE = "v and v_n are noisier than w, by the geometry"
"""Section 4, on the measured speeds; in the project's words."""
MPC_SENTENCE = "takes into account saturation and friction"
"""Conclusion, on the model predictive controller of Araujo et al. 2011."""
