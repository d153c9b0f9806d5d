"""One implicit stage under Coulomb friction, and its derivatives.

A stage of length tau from x* asks for

    M (v - x*) + tau (D v - m omega (v_y, -v_x, 0) + f(v) - F) = 0,   f(0) in the set of what friction holds

About yaw it is a soft threshold. In the plane, with A = M + tau D + the turning frame and b what drives,

    per axis           A v + tau C sgn(v) = b
    along the travel   (rho A' + tau c) n = b',  |n| = 1,  v = rho n / s;   at rest where |b/C| <= tau

with s = C, c = 1 and A' = A/(s s'), b' = b/s for the ellipse of maximum dissipation (rho = |C v|), and s = 1, c = C for
the plain one (rho = |v|). The scalar equation |n(rho)| = 1 is solved by Newton's steps on 1/|n| - 1, nearly linear in
rho. Where D couples yaw to the plane, omega is found by secants around both.

Derivatives are those of the solution: J dv = dR, J the slope of the equation within what slides; what is stuck stays.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.simulation.coulomb.law import BACKWARD, BOX, DAMPING, FORWARD, MASS, PLAIN, TRAVEL, TURNING

NEWTON_STEPS, BISECTIONS, SECANTS = 12, 200, 60
NEAR = 1e-8  # of |n|^2: Newton's next step is below rounding
SIGN, RHO, NX, NY = 0, 3, 4, 5  # places in `slides`: sign of each axis, 0 where it is stuck; of the ellipse
SLIDES = 6


@part
def level(law, axis, sign):
    """Level of an axis against motion of this sign."""
    return law[FORWARD + axis] if sign > 0.0 else law[BACKWARD + axis]


@part
def soft(b, forward, backward):
    """b beyond what holds it: b - forward, b + backward, or 0."""
    if b > forward:
        return b - forward
    return b + backward if b < -backward else 0.0


@part
def _sign(value, b, forward, backward):
    """Sign of the friction: of the value; at a value of 0 that nothing holds, of what drives."""
    if value > 0.0 or (value == 0.0 and forward == 0.0 and b >= 0.0):
        return 1.0
    return -1.0 if value < 0.0 or (value == 0.0 and backward == 0.0) else 0.0


@part
def _box(tau, bx, by, a00, a01, a10, a11, law, x, slides):
    """The plane of a stage under friction per axis, into x and slides."""
    fx, rx, fy, ry = tau * law[FORWARD], tau * law[BACKWARD], tau * law[FORWARD + 1], tau * law[BACKWARD + 1]
    drive = bx - a01 * soft(by, fy, ry) / a11
    rest = soft(drive, fx, rx)
    if rest == 0.0:
        x[0], x[1] = 0.0, soft(by, fy, ry) / a11
    else:
        left = bx - fx if rest > 0.0 else bx + rx
        x[1] = soft(by - a10 * left / a00, fy, ry) / (a11 - a10 * a01 / a00)
        x[0] = (left - a01 * x[1]) / a00
    slides[0] = _sign(x[0], drive, fx, rx)
    slides[1] = _sign(x[1], by - a10 * x[0], fy, ry)


@part
def _travel(tau, bx, by, a00, a01, a10, a11, law, plain, guess, x, slides):
    """The plane of a stage under friction along the direction of travel, into x and slides. guess: of rho."""
    cx, cy = law[TRAVEL], law[TRAVEL + 1]
    sx, sy, px, py = (1.0, 1.0, tau * cx, tau * cy) if plain else (cx, cy, tau, tau)
    hx, hy = bx / cx, by / cy
    if hx * hx + hy * hy <= tau * tau:
        x[0], x[1] = 0.0, 0.0
        slides[0], slides[1], slides[RHO] = 0.0, 0.0, 0.0
        return
    tx, ty = bx / sx, by / sy
    axx, axy, ayx, ayy = a00 / (sx * sx), a01 / (sx * sy), a10 / (sx * sy), a11 / (sy * sy)
    low, high, rho, nx, ny = 0.0, -1.0, guess, 0.0, 0.0
    for k in range(NEWTON_STEPS + BISECTIONS):
        p00, p01, p10, p11 = rho * axx + px, rho * axy, rho * ayx, rho * ayy + py
        det = 1.0 / (p00 * p11 - p01 * p10)
        nx, ny = (p11 * tx - p01 * ty) * det, (p00 * ty - p10 * tx) * det
        vx, vy = axx * nx + axy * ny, ayx * nx + ayy * ny
        ex, ey = (p11 * vx - p01 * vy) * det, (p00 * vy - p10 * vx) * det
        size2 = nx * nx + ny * ny
        change = -(size2 - size2 * math.sqrt(size2)) / (nx * ex + ny * ey)
        if abs(size2 - 1.0) < NEAR and rho + change > 0.0:
            nx, ny, rho = nx - change * ex, ny - change * ey, rho + change
            break
        if k >= NEWTON_STEPS:  # between bounds, halved where Newton leaves them
            if high < 0.0:
                mean, half = 0.5 * (axx + ayy), 0.5 * (axx - ayy)
                least = mean - math.hypot(half, 0.5 * (axy + ayx))
                high, rho = (math.hypot(tx, ty) - min(px, py)) / max(least, 1e-300), 0.0
                rho = 0.5 * high
                continue
            if size2 > 1.0:
                low = rho
            else:
                high = rho
            if not low < rho + change < high:
                change = 0.5 * (low + high) - rho
            if high - low <= 1e-16 * high:
                break
        rho = max(rho + change, 0.0)
    x[0], x[1] = rho * nx / sx, rho * ny / sy
    slides[0], slides[1], slides[RHO], slides[NX], slides[NY] = 1.0, 1.0, rho, nx, ny


@part
def speed_along(law, kind, vx, vy):
    """rho of a velocity: |C v|, or |v| of the plain ellipse."""
    if kind == PLAIN:
        return math.hypot(vx, vy)
    return math.hypot(law[TRAVEL] * vx, law[TRAVEL + 1] * vy)


@part
def _plane(tau, goal, force, law, kind, guess, x, slides):
    """The plane of a stage at the yaw rate x[2]."""
    mass, turn = law[MASS], tau * law[TURNING] * x[2]
    bx = mass * goal[0] + tau * (force[0] - law[DAMPING + 2] * x[2])
    by = law[MASS + 4] * goal[1] + tau * (force[1] - law[DAMPING + 5] * x[2])
    a00, a01 = mass + tau * law[DAMPING], tau * law[DAMPING + 1] - turn
    a10, a11 = tau * law[DAMPING + 3] + turn, law[MASS + 4] + tau * law[DAMPING + 4]
    if kind == BOX:
        _box(tau, bx, by, a00, a01, a10, a11, law, x, slides)
    else:
        _travel(tau, bx, by, a00, a01, a10, a11, law, kind == PLAIN, guess, x, slides)


@part
def _yaw(tau, goal, force, law, vx, vy, slides):
    """omega of a stage at this velocity."""
    b = law[MASS + 8] * goal[2] + tau * (force[2] - law[DAMPING + 6] * vx - law[DAMPING + 7] * vy)
    forward, backward = tau * law[FORWARD + 2], tau * law[BACKWARD + 2]
    omega = soft(b, forward, backward) / (law[MASS + 8] + tau * law[DAMPING + 8])
    slides[2] = _sign(omega, b, forward, backward)
    return omega


@part
def solve_stage(tau, goal, force, law, kind, guess, x, slides):
    """Solve a stage: its velocities into x (3,), what slides into `slides`. guess: of rho."""
    x[2] = _yaw(tau, goal, force, law, x[0], x[1], slides)
    _plane(tau, goal, force, law, kind, guess, x, slides)
    if law[DAMPING + 6] == 0.0 and law[DAMPING + 7] == 0.0:
        return
    before, gap_before = x[2], _yaw(tau, goal, force, law, x[0], x[1], slides) - x[2]
    x[2] = before + gap_before
    for _ in range(SECANTS):
        _plane(tau, goal, force, law, kind, max(slides[RHO], guess), x, slides)
        now = x[2]
        gap = _yaw(tau, goal, force, law, x[0], x[1], slides) - now
        if abs(gap) <= 1e-15 * abs(now):
            break
        slope = (gap - gap_before) / (now - before) if now != before else -1.0
        before, gap_before = now, gap
        x[2] = now - gap / slope if slope < -1e-3 else now + gap


@part
def _slopes(tau, x, law, kind, slides, inverse):
    """Into `inverse` (9,): that of the slope of a stage's equation within what slides; rows of what is stuck are 0."""
    turn, m = tau * law[TURNING], law[MASS]
    a, b, c = m + tau * law[DAMPING], tau * law[DAMPING + 1] - turn * x[2], tau * law[DAMPING + 2] - turn * x[1]
    d, e, f = (
        tau * law[DAMPING + 3] + turn * x[2],
        law[MASS + 4] + tau * law[DAMPING + 4],
        tau * law[DAMPING + 5] + turn * x[0],
    )
    g, h, i = tau * law[DAMPING + 6], tau * law[DAMPING + 7], law[MASS + 8] + tau * law[DAMPING + 8]
    if kind != BOX and slides[0] != 0.0:
        cx, cy, nx, ny, share = law[TRAVEL], law[TRAVEL + 1], slides[NX], slides[NY], tau / slides[RHO]
        if kind == PLAIN:
            a, b, d, e = (
                a + share * cx * ny * ny,
                b - share * cx * nx * ny,
                d - share * cy * nx * ny,
                e + share * cy * nx * nx,
            )
        else:
            cross = share * cx * cy * nx * ny
            a, b, d, e = a + share * cx * cx * ny * ny, b - cross, d - cross, e + share * cy * cy * nx * nx
    if slides[0] == 0.0:
        a, b, c, d, g = 1.0, 0.0, 0.0, 0.0, 0.0
    if slides[1] == 0.0:
        e, b, d, f, h = 1.0, 0.0, 0.0, 0.0, 0.0
    if slides[2] == 0.0:
        i, c, f, g, h = 1.0, 0.0, 0.0, 0.0, 0.0
    p, q, r = e * i - f * h, f * g - d * i, d * h - e * g
    det = 1.0 / (a * p + b * q + c * r)
    inverse[0], inverse[1], inverse[2] = p * det, (c * h - b * i) * det, (b * f - c * e) * det
    inverse[3], inverse[4], inverse[5] = q * det, (a * i - c * g) * det, (c * d - a * f) * det
    inverse[6], inverse[7], inverse[8] = r * det, (b * g - a * h) * det, (a * e - b * d) * det
    for axis in range(3):
        if slides[axis] == 0.0:
            for k in range(3):
                inverse[3 * axis + k] = 0.0


@part
def stage_derivatives(tau, goal, x, law, dlaw, kind, slides, dgoal, dforce, inverse, out):
    """Derivatives (3, K) of a stage solved at x into `out`, which may be dgoal; dlaw (SIZE, R), R <= K: the first R
    change the law, all of them what drives."""
    _slopes(tau, x, law, kind, slides, inverse)
    vx, vy, w = x[0], x[1], x[2]
    px, py, pw = goal[0] - vx, goal[1] - vy, goal[2] - w
    mx, my, mw = law[MASS], law[MASS + 4], law[MASS + 8]
    i0, i1, i2, i3, i4, i5 = inverse[0], inverse[1], inverse[2], inverse[3], inverse[4], inverse[5]
    i6, i7, i8 = inverse[6], inverse[7], inverse[8]
    xx = xy = yx = yy = 0.0  # slopes of friction along x and y by the levels of the plane
    row_x, row_y = TRAVEL, TRAVEL + 1
    if kind == BOX:
        row_x = FORWARD if slides[0] > 0.0 else BACKWARD
        row_y = FORWARD + 1 if slides[1] > 0.0 else BACKWARD + 1
        xx, yy = slides[0], slides[1]
    elif slides[0] != 0.0:
        nx, ny = slides[NX], slides[NY]
        if kind == PLAIN:
            xx, yy = nx, ny
        else:
            ratio = law[TRAVEL] / law[TRAVEL + 1]
            xx, yy = 2.0 * nx - nx * nx * nx, 2.0 * ny - ny * ny * ny
            xy, yx = -ratio * nx * ny * ny, -ny * nx * nx / ratio
    row_w, ww = FORWARD + 2 if slides[2] > 0.0 else BACKWARD + 2, slides[2]
    changed = dlaw.shape[1]
    for k in range(out.shape[1]):
        rx, ry, rw = mx * dgoal[0, k] + tau * dforce[0, k], my * dgoal[1, k] + tau * dforce[1, k], mw * dgoal[2, k]
        rw += tau * dforce[2, k]
        if k < changed:
            dm = dlaw[TURNING, k] * w
            rx += dlaw[MASS, k] * px + dlaw[MASS + 1, k] * py + dlaw[MASS + 2, k] * pw
            ry += dlaw[MASS + 3, k] * px + dlaw[MASS + 4, k] * py + dlaw[MASS + 5, k] * pw
            rw += dlaw[MASS + 6, k] * px + dlaw[MASS + 7, k] * py + dlaw[MASS + 8, k] * pw
            sx = dlaw[DAMPING, k] * vx + dlaw[DAMPING + 1, k] * vy + dlaw[DAMPING + 2, k] * w
            sy = dlaw[DAMPING + 3, k] * vx + dlaw[DAMPING + 4, k] * vy + dlaw[DAMPING + 5, k] * w
            sw = dlaw[DAMPING + 6, k] * vx + dlaw[DAMPING + 7, k] * vy + dlaw[DAMPING + 8, k] * w
            rx -= tau * (sx - dm * vy + xx * dlaw[row_x, k] + xy * dlaw[row_y, k])
            ry -= tau * (sy + dm * vx + yx * dlaw[row_x, k] + yy * dlaw[row_y, k])
            rw -= tau * (sw + ww * dlaw[row_w, k])
        out[0, k] = i0 * rx + i1 * ry + i2 * rw
        out[1, k] = i3 * rx + i4 * ry + i5 * rw
        out[2, k] = i6 * rx + i7 * ry + i8 * rw
