"""What commands the motors: volts, a duty of a supply, or a speed loop in the firmware."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from omnidyn.model.value import PerWheel, Value, number, per_wheel_number, points

VOLTAGE, DUTY, SPEED = "voltage", "duty", "speed"
BRAKE, COAST = "brake", "coast"

MOST_LATENCY = 10.0  # [s]

Gain = Annotated[PerWheel, per_wheel_number(0.0, 1e6)]


class Drive(Value):
    """How commands become voltages.

    kind: "voltage" applies the command; "duty": voltage = duty * supply; "speed": a PI loop on each wheel's speed.
    supply [V]: of the battery, where it is not logged. off: what a duty of 0 does, "brake" shorts the motor,
    "coast" opens it, so that no current flows.
    kp [V s/rad], ki [V/rad], rate [Hz]: the speed loop, on wheel-side speed; it saturates at the voltage limit and
    stops integrating there.
    dead_band [V]: of a voltage u, (|u| - dead_band)+ sgn u reaches the motor. latency [s]: until a command does.
    voltage_map: (voltage asked, voltage passed on, its std or nothing) [V] of a driver that is no line, both directions
    alike, straight between the points, through 0; it comes before the dead band.
    """

    kind: Annotated[Literal["voltage", "duty", "speed"], Field(description="what a command is")] = VOLTAGE
    supply: Annotated[
        Annotated[float, number(1e-3, 1e5)] | None, Field(alias="supply_V", description="of the battery")
    ] = None
    off: Annotated[Literal["brake", "coast"], Field(description="at a duty of 0")] = BRAKE
    kp: Annotated[Gain, Field(alias="kp_V_s_rad", description="on wheel-side speed")] = 0.0
    ki: Annotated[Gain, Field(alias="ki_V_rad", description="on wheel-side angle")] = 0.0
    rate: Annotated[
        Annotated[float, number(0.1, 1e6)] | None, Field(alias="rate_Hz", description="of the speed loop")
    ] = None
    dead_band: Annotated[
        Annotated[float, number(0.0, 1e4)], Field(alias="dead_band_V", description="of the driver, lost of any voltage")
    ] = 0.0
    latency: Annotated[
        Annotated[float, number(0.0, MOST_LATENCY)],
        Field(alias="latency_s", description="from a command to the motors"),
    ] = 0.0
    voltage_map: Annotated[
        Annotated[tuple[tuple[float, ...], ...], points(1e4)],
        Field(alias="voltage_map_V", description="asked, passed on, std"),
    ] = ()

    @property
    def coasts(self) -> bool:
        """Whether a duty of 0 opens the motor."""
        return self.kind == DUTY and self.off == COAST

    @model_validator(mode="after")
    def _complete(self) -> Drive:
        if self.kind == SPEED and (self.rate is None or (self.kp == 0.0 and self.ki == 0.0)):
            raise ValueError('kind = "speed" needs rate_Hz and kp_V_s_rad or ki_V_rad')
        if self.kind == SPEED and self.voltage_map:
            raise ValueError('kind = "speed" takes no voltage_map_V; expected kind = "duty" or "voltage"')
        asked, passed = ([point[k] for point in self.voltage_map] for k in (0, 1))
        if any(b <= a for a, b in (*pairwise([0.0, *asked]), *pairwise(passed))) or passed == [0.0]:
            raise ValueError(
                f"voltage_map_V is not monotone; got {[list(point[:2]) for point in self.voltage_map]}; expected pairs "
                "[asked, passed on] above 0 that both rise; only the first may pass on 0"
            )
        return self
