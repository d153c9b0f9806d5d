"""The program of one step of the controller: the model along a predicted motion, made linear there.

    twist+ = DECAY twist + PHI (a + d - f(twist+) + frame(middle)),   middle = (twist + twist+)/2

f, the friction, is taken where the step ends, as in an implicit step: what slides is exact, what would turn round
stops. Below a small speed it falls linearly to 0. The program is given a wider slope than that, largest at rest and
falling to 0: it tells that friction gives way where motion turns round, which the level along one predicted motion
hides; saturated wheels need it. It acts on the end of the step, so that it never makes the prediction stiff. What falls
with the speed (Stribeck) is taken with its own slope along the prediction. With F the slope, J that of the frame terms
and G = F - J/2:

    V = K (DECAY + PHI J/2),   HV = K PHI,   K = (I + PHI G)^-1
    displacement = PHI twist + PSI (a + d - f + frame)     turned by the heading in the middle of the step

The position is linear in the heading along the predicted one.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.columns import CP, CV, GX, GY, HP, HV, E, V
from omnidyn.control.mpc.model import (
    BACKWARD,
    BY_MASS,
    BY_MASS_GX,
    DECAY,
    ELLIPSE,
    ELLIPSE_FALL,
    FALLING,
    FORWARD,
    MORE_BACKWARD,
    MORE_FORWARD,
    PHI,
    POWER,
    PSI,
    SHAPE,
    SLOW_SPEED,
    SOFT_SPEED,
    STEP,
    TURNING,
)
from omnidyn.control.mpc.small import added, inverse, matrix, minus, mm, mv, plus, put3, put9, vector
from omnidyn.model.friction.stribeck import fall


@part
def level_at(levels, e, speed):
    """(the level of part e at a speed, what it grows by with the size of the speed): it falls as Stribeck has it."""
    forward = speed >= 0.0
    level = levels[e, FORWARD] if forward else levels[e, BACKWARD]
    if levels[e, FALLING] == 0.0:
        return level, 0.0
    falling, slope = fall(abs(speed) * levels[e, FALLING], levels[e, SHAPE], levels[e, POWER])
    excess = levels[e, MORE_FORWARD] if forward else levels[e, MORE_BACKWARD]
    return level + excess * falling, excess * slope * levels[e, FALLING]


@part
def friction_at(linear, levels, scale, twist, narrow, soft):
    """(f, F): deceleration by dry friction at a twist [m/s^2, m/s^2, rad/s^2], and its slope by the twist.

    scale (3,): what was learned of each axis' level, 1 as modelled. soft: with the slope that the program needs, wider
    than the level itself.
    """
    f0 = f1 = f2 = 0.0
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = 0.0
    for e in range(len(levels)):
        x, y, z = vector(levels, e, 0)
        dx, dy, dz = vector(levels, e, BY_MASS_GX)
        speed, width = x * twist[0] + y * twist[1] + z * twist[2], narrow * levels[e, SLOW_SPEED]
        level, falls = level_at(levels, e, speed)
        share = min(max(speed / width, -1.0), 1.0)
        slope = level / width if abs(speed) < width else 0.0
        if soft:
            soft_width = levels[e, SOFT_SPEED]
            slope = 2.0 * level / soft_width * max(0.0, 1.0 - abs(speed) / soft_width)
        slope += abs(share) * falls
        force = level * share
        f0, f1, f2 = f0 + dx * force, f1 + dy * force, f2 + dz * force
        s0, s1, s2 = s0 + dx * x * slope, s1 + dx * y * slope, s2 + dx * z * slope
        s3, s4, s5 = s3 + dy * x * slope, s4 + dy * y * slope, s5 + dy * z * slope
        s6, s7, s8 = s6 + dz * x * slope, s7 + dz * y * slope, s8 + dz * z * slope
    if linear[0, ELLIPSE] > 0.0:
        ax, ay, width = linear[0, ELLIPSE], linear[0, ELLIPSE + 1], narrow * linear[0, ELLIPSE + 2]
        bx = by = speed = 0.0  # by what of itself each level grows with the speed
        if linear[0, ELLIPSE_FALL] > 0.0:
            more_x, more_y = linear[0, ELLIPSE_FALL + 3], linear[0, ELLIPSE_FALL + 4]
            speed = math.hypot(twist[0], twist[1])
            shape, power = linear[0, ELLIPSE_FALL + 1], linear[0, ELLIPSE_FALL + 2]
            falling, by_speed = fall(speed * linear[0, ELLIPSE_FALL], shape, power)
            ax, ay, by_speed = ax + more_x * falling, ay + more_y * falling, by_speed * linear[0, ELLIPSE_FALL]
            bx, by = more_x * by_speed / ax, more_y * by_speed / ay
        qx, qy = ax * ax, ay * ay
        size = math.sqrt(qx * twist[0] * twist[0] + qy * twist[1] * twist[1])
        r = 1.0 / max(size, width)
        fx, fy = qx * twist[0] * r, qy * twist[1] * r
        bend = r if size > width else 0.0
        grows_x = grows_y = 0.0
        if speed > 0.0:
            coupling = 0.0 if bend == 0.0 else (fx * twist[0] * bx + fy * twist[1] * by) * bend
            grows_x, grows_y = fx * (2.0 * bx - coupling) / speed, fy * (2.0 * by - coupling) / speed
        b = matrix(linear, 0, BY_MASS)
        g = mm(
            b,
            (
                qx * r - fx * fx * bend + grows_x * twist[0],
                -fx * fy * bend + grows_x * twist[1],
                0.0,
                -fx * fy * bend + grows_y * twist[0],
                qy * r - fy * fy * bend + grows_y * twist[1],
                0.0,
                0.0,
                0.0,
                0.0,
            ),
        )
        v = mv(b, (fx, fy, 0.0))
        f0, f1, f2 = f0 + v[0], f1 + v[1], f2 + v[2]
        s0, s1, s2, s3, s4, s5 = s0 + g[0], s1 + g[1], s2 + g[2], s3 + g[3], s4 + g[4], s5 + g[5]
        s6, s7, s8 = s6 + g[6], s7 + g[7], s8 + g[8]
    a, b, c = scale[0], scale[1], scale[2]
    return (a * f0, b * f1, c * f2), (a * s0, a * s1, a * s2, b * s3, b * s4, b * s5, c * s6, c * s7, c * s8)


@part
def frame_at(linear, twist):
    """(terms of a turning frame [m/s^2, m/s^2, rad/s^2], their slope by the twist)."""
    t = matrix(linear, 0, TURNING)
    x, y, w = twist
    return mv(t, (w * y, -w * x, w * w)), mm(t, (0.0, w, y, -w, 0.0, -x, 0.0, 0.0, 2.0 * w))


@part
def linear_stage(linear, friction, push, stage, k, heading, twist, end):
    """Step k of `stage` along a predicted motion: heading and twist where it starts, twist where it ends.

    friction: of `friction_at`. push: d, what else speeds the robot up [m/s^2, m/s^2, rad/s^2].
    """
    phi, psi = matrix(linear, 0, PHI), matrix(linear, 0, PSI)
    f, slope = friction
    const = minus(plus(push, mv(slope, end)), f)
    v, hv = matrix(linear, 0, DECAY), phi
    m, hd = phi, psi
    resists, turning = False, linear[0, TURNING] != 0.0
    for i in range(9):
        resists |= slope[i] != 0.0
    if turning:
        middle = 0.5 * (twist[0] + end[0]), 0.5 * (twist[1] + end[1]), 0.5 * (twist[2] + end[2])
        n, j = frame_at(linear, middle)
        half = (
            0.5 * j[0],
            0.5 * j[1],
            0.5 * j[2],
            0.5 * j[3],
            0.5 * j[4],
            0.5 * j[5],
            0.5 * j[6],
            0.5 * j[7],
            (0.5 * j[8]),
        )
        const = plus(const, minus(n, mv(j, middle)))
        slope = added(slope, (-half[0], -half[1], -half[2], -half[3], -half[4], -half[5], -half[6], -half[7], -half[8]))
        v, m = added(v, mm(phi, half)), added(m, mm(psi, half))
    if resists | turning:
        stiff = mm(phi, slope)
        k_ = inverse(
            (1.0 + stiff[0], stiff[1], stiff[2], stiff[3], 1.0 + stiff[4], stiff[5], stiff[6], stiff[7], 1.0 + stiff[8])
        )
        v, hv = mm(k_, v), mm(k_, hv)
        back = mm(psi, slope)
        back = (-back[0], -back[1], -back[2], -back[3], -back[4], -back[5], -back[6], -back[7], -back[8])
        m, hd = added(m, mm(back, v)), added(hd, mm(back, hv))
    put9(stage, k, V, v)
    put9(stage, k, HV, hv)
    put3(stage, k, CV, mv(hv, const))
    along_path(stage, k, m, hd, mv(hd, const), heading, twist, end, linear[0, STEP])


@part
def along_path(stage, k, m, h, c, heading, twist, end, dt):
    """Rows of the pose from those of the displacement in the body, m twist + h a + c."""
    turn = 0.25 * (twist[2] + end[2]) * dt
    middle = heading + turn
    short = 1.0 - turn * turn / 6.0  # a chord is shorter than its arc
    cos, sin = short * math.cos(middle), short * math.sin(middle)
    dx, dy = 0.5 * (twist[0] + end[0]) * dt, 0.5 * (twist[1] + end[1]) * dt
    gx, gy = -sin * dx - cos * dy, cos * dx - sin * dy
    stage[k, GX], stage[k, GY] = gx, gy
    hx, hy = 0.5 * gx, 0.5 * gy
    for column, t in ((E, m), (HP, h)):
        x, y, z = (t[0], t[1], t[2]), (t[3], t[4], t[5]), (t[6], t[7], t[8])
        put9(
            stage,
            k,
            column,
            (
                cos * x[0] - sin * y[0] + hx * z[0],
                cos * x[1] - sin * y[1] + hx * z[1],
                cos * x[2] - sin * y[2] + hx * z[2],
                sin * x[0] + cos * y[0] + hy * z[0],
                sin * x[1] + cos * y[1] + hy * z[1],
                sin * x[2] + cos * y[2] + hy * z[2],
                z[0],
                z[1],
                z[2],
            ),
        )
    put3(
        stage,
        k,
        CP,
        (
            cos * c[0] - sin * c[1] + hx * c[2] - gx * middle,
            sin * c[0] + cos * c[1] + hy * c[2] - gy * middle,
            c[2],
        ),
    )
