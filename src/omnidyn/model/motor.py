"""DC motors behind a gear, eqs (10)-(12), with the back-EMF of the motor shaft.

u = L di/dt + R i + K_v l w       (11)  w: wheel speed; the printed (11) leaves out the gear ratio l
T = l K_t i,  f = T / r           (10)
|i| <= i_max                      (12)  printed without the absolute value
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from omnidyn.arrays import FloatArray
from omnidyn.model.value import PerWheel, Value, per_wheel_number
from omnidyn.model.wheels import Wheels, per_wheel

QUASI_STATIC, DYNAMIC = "quasi-static", "dynamic"


class Motor(Value):
    """The motors of a robot; a tuple means one value per wheel.

    resistance [ohm], torque_constant [N m/A], emf_constant [V s/rad], both at the motor shaft; gear_ratio [-];
    voltage_limit [V]; inductance [H]; current_limit [A], None means no limit.
    voltage_drop [V]: lost in brushes and driver, against the current. gear_efficiency [-]: of power through the gear.
    rotor_inertia [kg m^2]: J of what spins with the motor shaft; at the wheel it is J l^2 (mass.py).
    electrical: "quasi-static" leaves L di/dt out of eq (11), "dynamic" keeps it.
    """

    resistance: Annotated[PerWheel, per_wheel_number(1e-6, 1e6), Field(alias="resistance_ohm", description="R")]
    inductance: Annotated[
        Annotated[PerWheel, per_wheel_number(1e-12, 1e3)] | None, Field(alias="inductance_H", description="L")
    ] = None
    torque_constant: Annotated[
        PerWheel, per_wheel_number(1e-9, 1e3), Field(alias="torque_constant_Nm_A", description="K_t at the motor shaft")
    ]
    emf_constant: Annotated[
        PerWheel, per_wheel_number(1e-9, 1e3), Field(alias="emf_constant_Vs_rad", description="K_v at the motor shaft")
    ]
    gear_ratio: Annotated[PerWheel, per_wheel_number(1e-3, 1e5), Field(description="l, motor turns per wheel turn")]
    voltage_limit: Annotated[
        PerWheel, per_wheel_number(1e-3, 1e5), Field(alias="voltage_limit_V", description="of the driver, both signs")
    ]
    current_limit: Annotated[
        Annotated[PerWheel, per_wheel_number(1e-6, 1e6)] | None,
        Field(alias="current_limit_A", description="|i| <= i_max, eq (12)"),
    ] = None
    voltage_drop: Annotated[
        PerWheel,
        per_wheel_number(0.0, 1e4),
        Field(alias="voltage_drop_V", description="brushes and driver, against the current"),
    ] = 0.0
    gear_efficiency: Annotated[
        PerWheel, per_wheel_number(0.05, 1.0), Field(description="of power through the gear, either way")
    ] = 1.0
    rotor_inertia: Annotated[
        PerWheel,
        per_wheel_number(0.0, 100.0),
        Field(alias="rotor_inertia_kg_m2", description="J at the motor shaft; 1 g cm^2 = 1e-7"),
    ] = 0.0
    electrical: Annotated[Literal["quasi-static", "dynamic"], Field(description="dynamic keeps L di/dt of eq (11)")] = (
        QUASI_STATIC
    )

    @model_validator(mode="after")
    def _dynamic_needs_inductance(self) -> Motor:
        if self.electrical == DYNAMIC and self.inductance is None:
            raise ValueError('electrical = "dynamic" needs inductance_H')
        return self


def back_emf(motor: Motor, wheel_speed: ArrayLike) -> FloatArray:
    """Back-EMF K_v l w [V] of motors whose wheels turn at `wheel_speed` [rad/s], eq (11). Shape (*batch, wheels)."""
    speed = np.asanyarray(wheel_speed, dtype=float)
    count = speed.shape[-1]
    return per_wheel(motor.emf_constant, count) * per_wheel(motor.gear_ratio, count) * speed


def settled_current(motor: Motor, voltage: ArrayLike, wheel_speed: ArrayLike) -> FloatArray:
    """Current [A] of eq (11) with di/dt = 0: soft(u - K_v l w, V_d) / R, within the current limit of eq (12).

    soft takes the voltage drop V_d off towards 0. `voltage` [V] and `wheel_speed` [rad/s], shape (*batch, wheels).
    Returns the same shape.
    """
    driving = np.asarray(voltage, dtype=float) - back_emf(motor, wheel_speed)
    count = driving.shape[-1]
    drop = per_wheel(motor.voltage_drop, count)
    if drop.any():
        driving = driving - np.clip(driving, -drop, drop)
    current = driving / per_wheel(motor.resistance, count)
    if motor.current_limit is None:
        return current
    limit = per_wheel(motor.current_limit, count)
    return np.clip(current, -limit, limit)


def voltage_of_current(motor: Motor, current: ArrayLike, wheel_speed: ArrayLike) -> FloatArray:
    """Voltage R i + K_v l w + V_d sgn i [V] under which a settled current flows, eq (11): `settled_current` backward.

    `current` [A] and `wheel_speed` [rad/s], shape (*batch, wheels). Returns the same shape; the current limit is not
    looked at, and of the voltages under which no current flows the back-EMF is given.
    """
    current = np.asanyarray(current, dtype=float)
    count = current.shape[-1]
    drop = per_wheel(motor.voltage_drop, count) * np.sign(current)
    return per_wheel(motor.resistance, count) * current + back_emf(motor, wheel_speed) + drop


def wheel_torque(motor: Motor, current: ArrayLike) -> FloatArray:
    """Torque l K_t i at the wheel [N m], eq (10). `current` [A], shape (*batch, wheels)."""
    current = np.asarray(current, dtype=float)
    count = current.shape[-1]
    return per_wheel(motor.gear_ratio, count) * per_wheel(motor.torque_constant, count) * current


def traction(motor: Motor, wheels: Wheels, current: ArrayLike) -> FloatArray:
    """Traction force T / r [N] of wheels that do not slip, eq (10). `current` [A], shape (*batch, wheels)."""
    return wheel_torque(motor, current) / wheels.radii


def mass_at_rim(motor: Motor, wheels: Wheels) -> FloatArray:
    """(J l^2 + J_w)/r^2 [kg] of each wheel: what a force at its rim has to speed up beside the body. (wheels,)."""
    count = wheels.count
    rotor, gear = per_wheel(motor.rotor_inertia, count), per_wheel(motor.gear_ratio, count)
    return (rotor * gear**2 + per_wheel(wheels.wheel_inertia, count)) / wheels.radii**2


def no_load_speed(motor: Motor, voltage: ArrayLike) -> FloatArray:
    """Wheel speed u / (K_v l) [rad/s] at which the back-EMF eats the whole voltage [V]. Shape (*batch, wheels)."""
    voltage = np.asarray(voltage, dtype=float)
    count = voltage.shape[-1]
    return voltage / (per_wheel(motor.emf_constant, count) * per_wheel(motor.gear_ratio, count))
