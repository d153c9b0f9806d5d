"""How one step of the exact formula changes with what goes into it: partial derivatives, by hand, branch by branch.

    x1 = e x + phi (q - c)                     slides       e = 1 - a phi,  phi = (1 - e^(-a h))/a
    x1 = (q + c)(phi - e x/D),  D = c - q      reverses     step.py has both
    x1 = 0                                     rests, or stops and stays: no argument changes it

A parameter p that moves v, g, c and a at once moves v1 by  dv1 = (dv1/dv) dv + (dv1/dg) dg + (dv1/dc) dc + (dv1/da) da.
Breakaway S only chooses the branch: its derivative is 0, and where S > c the jump at a release is not seen.
The instant of a stop or of a reversal moves too; that is in these formulas, for the crossing time has cancelled out.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.simulation.exact.step import course, crossing_time, held

SHORT = 1e-2  # a h below which the closed forms lose digits to cancellation and a series takes over


@part
def hold_slopes(rate, dt):
    """(phi, d phi/da [s^2], psi, d psi/da [s^3]) of a voltage held for dt: psi = (dt - phi)/a is the integral of phi.

    rate a > 0 [1/s], dt [s]. d phi/da = (e^(-a h) h - phi)/a; d psi/da = -(d phi/da + psi)/a.
    """
    x = rate * dt
    phi = held(rate, dt)
    if x < SHORT:  # term by term; the first one left out is below 1e-16
        dphi = -dt * dt * (0.5 - x / 3.0 + x**2 / 8.0 - x**3 / 30.0 + x**4 / 144.0 - x**5 / 840.0)
        psi = dt * dt * (0.5 - x / 6.0 + x**2 / 24.0 - x**3 / 120.0 + x**4 / 720.0 - x**5 / 5040.0)
        dpsi = -dt * dt * dt * (1.0 / 6.0 - x / 12.0 + x**2 / 40.0 - x**3 / 180.0 + x**4 / 1008.0 - x**5 / 6720.0)
        return phi, dphi, psi, dpsi
    dphi = (dt * (1.0 - rate * phi) - phi) / rate
    psi = (dt - phi) / rate
    return phi, dphi, psi, -(dphi + psi) / rate


@part
def step_slopes(speed, drive, coulomb, breakaway, rate, phi, dphi):
    """(v1, dv1/dv, dv1/dg, dv1/dc, dv1/da): `exact_step`, to the last bit, and its partial derivatives.

    Arguments as for `exact_step`; dphi = d phi/da [s^2] from `hold_slopes`. Units of the derivatives: 1, s, s, m.
    """
    mirrored, x, q, slid, rests, crosses, reverses = course(speed, drive, coulomb, breakaway, rate, phi, 0.0)
    if rests | (crosses & (not reverses)):
        return 0.0, 0.0, 0.0, 0.0, 0.0
    decay = 1.0 - rate * phi
    ddecay = -(phi + rate * dphi)
    if not crosses:
        value = slid if slid > 0.0 else 0.0
        by_coulomb, by_rate = -phi, dphi * (q - coulomb) + ddecay * x
        by_speed, by_drive = decay, phi
    else:
        divisor = coulomb - q
        inner = phi - (x - phi * rate * x) / divisor
        pull = (q + coulomb) * decay / divisor
        value = (q + coulomb) * inner
        by_speed = -pull
        by_drive, by_coulomb = inner - pull * x / divisor, inner + pull * x / divisor
        by_rate = (q + coulomb) * (dphi - ddecay * x / divisor)
    if mirrored:
        return (-value if value != 0.0 else 0.0), by_speed, by_drive, -by_coulomb, -by_rate
    return value, by_speed, by_drive, by_coulomb, by_rate


@part
def acceleration_at_end(speed, drive, coulomb, breakaway, rate):
    """dv1/dh of a step that ends at `speed`: g - a v - c sgn v, and 0 for what rests. Units as for `exact_step`."""
    if speed == 0.0:
        if abs(drive) <= breakaway:
            return 0.0
        return drive - coulomb if drive > 0.0 else drive + coulomb
    return drive - rate * speed - (coulomb if speed > 0.0 else -coulomb)


@part
def travel_slopes(speed, drive, coulomb, breakaway, rate, dt, phi, dphi, psi, dpsi):
    """(s, ds/dv, ds/dg, ds/dc, ds/da), s the integral of the speed over the step: for yaw the angle turned [rad].

        slides      s = v phi + f psi,  f = g - c sgn v
        up to 0     s = (x - D t)/a,  t = log(1 + a x/D)/a the time of the event
        and back    s = f2 psi(h - t) with f2 = g + c sgn v: from rest, under the reversed friction

    phi, dphi, psi, dpsi from `hold_slopes`. Source: integrals of the pieces of step.py; ds/dt = 0 at the event,
    where the speed is 0, so that its time adds no derivative of its own.
    """
    mirrored, x, q, _, rests, crosses, reverses = course(speed, drive, coulomb, breakaway, rate, phi, 0.0)
    if rests:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    if not crosses:
        travel = x * phi + (q - coulomb) * psi
        by_speed, by_drive, by_coulomb = phi, psi, -psi
        by_rate = x * dphi + (q - coulomb) * dpsi
    else:
        divisor = coulomb - q
        event = crossing_time(x, q, coulomb, rate, dt)
        phi1, dphi1, psi1, dpsi1 = hold_slopes(rate, event)
        travel = x * phi1 - divisor * psi1
        by_speed, by_drive, by_coulomb = phi1, psi1, -psi1
        by_rate = x * dphi1 - divisor * dpsi1
        if reverses:
            _, _, psi2, dpsi2 = hold_slopes(rate, dt - event)
            phi2 = (dt - event) - rate * psi2
            after = q + coulomb
            # The event comes later by dt; the way back is shorter by phi2 after dt.
            rest = 1.0 / (divisor * (1.0 + rate * x / divisor))  # dt/dx
            back = -phi2 * after
            late = -x * rest / divisor  # dt/dD
            by_clock = x * rest / rate - event / rate  # dt/da
            travel += after * psi2
            by_speed += back * rest
            by_drive += psi2 - back * late
            by_coulomb += psi2 + back * late
            by_rate += after * dpsi2 + back * by_clock
    if mirrored:
        return -travel, by_speed, by_drive, -by_coulomb, -by_rate
    return travel, by_speed, by_drive, by_coulomb, by_rate
