"""Which column is which wheel, and with which sign: every order and every sign of the wheels is tried.

Three redundancies are used, each a sum of squares that is 0 for the right wiring: the twist over the floor against
the twist of the wheels (and, beyond three wheels, what the wheels must agree on among themselves); u - R i - K l w of
each motor; and the likeness of voltage, command and speed where no number of the motor is known. An answer is given
only where it explains the log much better than the wiring as logged; wirings that the log cannot tell apart are said.
"""

from __future__ import annotations

from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import CIRCUIT
from omnidyn.findings.wiring.floor import axes_finding, by_floor, mended_axes, wheels_finding
from omnidyn.findings.wiring.motor_columns import by_circuit, by_drive, by_likeness, motor_finding, motor_known
from omnidyn.findings.wiring.orders import Wiring
from omnidyn.findings.wiring.pose_frame import check_frame
from omnidyn.sensors import OF_MOTORS, OF_WHEELS


def check_wiring(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on order and sign of the columns of motors and axes; the work with them put right."""
    if len(work) < MIN_ROWS or work.wheels < 1:
        return [], work
    findings: list[Finding] = []
    circuit = by_circuit(work)  # of each motor for itself: it names the column, so it comes first
    if circuit.wrong is not None:
        findings.append(motor_finding(work, *circuit.wrong, CIRCUIT))
        work = _mended(work, (circuit.wrong[0],), circuit.wrong[1].best)
    floor = by_floor(work)
    framed, turned = check_frame(work, floor[1].left if floor is not None else 1.0)
    if framed:
        findings, work, floor = findings + framed, turned, by_floor(turned)
    likeness = None if circuit.holds else by_drive(work)
    if floor is not None and floor[0] == "axes":
        findings.append(axes_finding(work, floor[1]))
        work = mended_axes(work, floor[1].best)
    elif floor is not None:
        motors_trusted = circuit.holds or (motor_known(work) and likeness is None)
        findings.append(wheels_finding(work, floor[1], "motors" if motors_trusted else "wheel_speed"))
        work = _mended(work, OF_MOTORS if motors_trusted else OF_WHEELS, floor[1].best)
        likeness = None if circuit.holds else by_drive(work)
    if likeness is not None:
        findings.append(motor_finding(work, *likeness))
        work = _mended(work, (likeness[0],), likeness[1].best)
    command = by_likeness(work, "wheel_speed_command")
    if command is not None:
        findings.append(motor_finding(work, "wheel_speed_command", command))
        work = _mended(work, ("wheel_speed_command",), command.best)
    return findings, work


def _mended(work: LogUnderCheck, channels: tuple[str, ...], wiring: Wiring) -> LogUnderCheck:
    for channel in channels:
        values = work.channels.get(channel)
        if values is not None:
            work = work.replace(**{channel: wiring.applied(values)})
    return work
