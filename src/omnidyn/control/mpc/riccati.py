"""One equality-constrained solve of the horizon: backward pass, forward pass; cost linear in the horizon.

    min  sum_k 1/2 x_k^T Q_k x_k + l_k . x_k + sum_i 1/2 r_i (u_i - uref_i)^2,   a = B u,   x+ = A x + H a + c

Inputs enter through the drive a only, which has three entries however many wheels there are. With the cost to go S, s
after a step,  Y = H^T S H,  Z = H^T S A,  C = B diag(1/r) B^T:

    q = Z x + H^T (s + S c) + Y a0,   a0 = B uref          slope of the cost by the drive, at a = a0
    g = q - Y W q,   W = (I + C Y)^-1 C                    the same at the optimum
    u_i = uref_i - (1/r_i) b_i . g                         b_i: column i of B
    P = A^T S A - Z^T W Z,   p = A^T (s + S c) + Z^T (a0 - W q0)

1/r_i = 0 holds an input at uref_i: a bound. The interior point method adds its barrier to r and uref. One primitive
serves both, and redundant wheels. Source: Riccati recursion, e.g. Rawlings, Mayne, Diehl, Model Predictive Control
(2017), section 8.8.3; W by the matrix inversion lemma.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.control.mpc.columns import (
    A0,
    CP,
    CV,
    GX,
    GY,
    H1,
    H2,
    HP,
    HV,
    P1,
    P2,
    P11,
    P12,
    P22,
    PULL,
    Q0,
    WEIGHT,
    Z1,
    Z2,
    E,
    V,
    W,
    Y,
)
from omnidyn.control.mpc.small import (
    added,
    dot,
    full,
    gain_of,
    matrix,
    minus,
    mm,
    mv,
    plus,
    put3,
    put6,
    put9,
    sm,
    sv,
    symmetric,
    tm,
    tms,
    transposed,
    tv,
    vector,
)


@part
def column(push, i):
    """Column i of B: the drive of one volt on wheel i."""
    return push[0, i], push[1, i], push[2, i]


@part
def compliance(push, inverse, k):
    """C = B diag(1/r) B^T of stage k."""
    c0 = c1 = c2 = c3 = c4 = c5 = 0.0
    for i in range(inverse.shape[1]):
        r = inverse[k, i]
        x, y, z = push[0, i], push[1, i], push[2, i]
        c0, c1, c2 = c0 + r * x * x, c1 + r * x * y, c2 + r * x * z
        c3, c4, c5 = c3 + r * y * y, c4 + r * y * z, c5 + r * z * z
    return c0, c1, c2, c3, c4, c5


@part
def drive_of(push, u, k):
    """a = B u of stage k."""
    x = y = z = 0.0
    for i in range(u.shape[1]):
        x, y, z = x + push[0, i] * u[k, i], y + push[1, i] * u[k, i], z + push[2, i] * u[k, i]
    return x, y, z


@part
def turned_rows(m, gx, gy):
    """(I + turn)^T m."""
    return (
        m[0],
        m[1],
        m[2],
        m[3],
        m[4],
        m[5],
        m[6] + gx * m[0] + gy * m[3],
        m[7] + gx * m[1] + gy * m[4],
        (m[8] + gx * m[2] + gy * m[5]),
    )


@part
def turned_columns(m, gx, gy):
    """m (I + turn)."""
    return (
        m[0],
        m[1],
        m[2] + gx * m[0] + gy * m[1],
        m[3],
        m[4],
        m[5] + gx * m[3] + gy * m[4],
        m[6],
        m[7],
        (m[8] + gx * m[6] + gy * m[7]),
    )


@part
def factor_stage(stage, answer, push, inverse, k, n):
    """The matrices of step k: P, Y, Z, W, and S c, from the cost to go of step k + 1; 0 after the last, n - 1."""
    zero = 0.0
    w1, w2 = vector(stage, k, WEIGHT), vector(stage, k, WEIGHT + 3)
    p11, p22 = (w1[0], zero, zero, w1[1], zero, w1[2]), (w2[0], zero, zero, w2[1], zero, w2[2])
    s12 = (zero, zero, zero, zero, zero, zero, zero, zero, zero)
    s11, s22 = p11, p22
    if k + 1 < n:
        t, s12, r = symmetric(answer, k + 1, P11), matrix(answer, k + 1, P12), symmetric(answer, k + 1, P22)
        s11 = t[0] + w1[0], t[1], t[2], t[3] + w1[1], t[4], t[5] + w1[2]
        s22 = r[0] + w2[0], r[1], r[2], r[3] + w2[1], r[4], r[5] + w2[2]
    c1, c2 = vector(stage, k, CP), vector(stage, k, CV)
    put3(answer, k, H1, plus(sv(s11, c1), mv(s12, c2)))
    put3(answer, k, H2, plus(tv(s12, c1), sv(s22, c2)))
    hp, hv = matrix(stage, k, HP), matrix(stage, k, HV)
    l1, l2 = added(sm(s11, hp), mm(s12, hv)), added(tm(s12, hp), sm(s22, hv))
    y, second = tms(hp, l1), tms(hv, l2)
    y = y[0] + second[0], y[1] + second[1], y[2] + second[2], y[3] + second[3], y[4] + second[4], y[5] + second[5]
    w = gain_of(y, compliance(push, inverse, k))
    put6(answer, k, Y, y)
    put6(answer, k, W, w)
    e, v = matrix(stage, k, E), matrix(stage, k, V)
    gx, gy = stage[k, GX], stage[k, GY]
    z1, z2 = turned_columns(transposed(l1), gx, gy), added(tm(l1, e), tm(l2, v))
    put9(answer, k, Z1, z1)
    put9(answer, k, Z2, z2)
    if k == 0:
        return
    m1, m2 = added(sm(s11, e), mm(s12, v)), added(tm(s12, e), sm(s22, v))
    wz1, wz2 = sm(w, z1), sm(w, z2)
    q22, r22, f22 = tms(e, m1), tms(v, m2), tms(z2, wz2)
    q11, f11 = turned_rows(turned_columns(full(s11), gx, gy), gx, gy), tms(z1, wz1)
    q12, f12 = turned_rows(m1, gx, gy), tm(z1, wz2)
    put6(
        answer,
        k,
        P11,
        (q11[0] - f11[0], q11[1] - f11[1], q11[2] - f11[2], q11[4] - f11[3], q11[5] - f11[4], q11[8] - f11[5]),
    )
    put3(answer, k, P12, (q12[0] - f12[0], q12[1] - f12[1], q12[2] - f12[2]))
    put3(answer, k, P12 + 3, (q12[3] - f12[3], q12[4] - f12[4], q12[5] - f12[5]))
    put3(answer, k, P12 + 6, (q12[6] - f12[6], q12[7] - f12[7], q12[8] - f12[8]))
    put3(answer, k, P22, (q22[0] + r22[0] - f22[0], q22[1] + r22[1] - f22[1], q22[2] + r22[2] - f22[2]))
    put3(answer, k, P22 + 3, (q22[3] + r22[3] - f22[3], q22[4] + r22[4] - f22[4], q22[5] + r22[5] - f22[5]))


@part
def vector_stage(stage, answer, push, target, k, n):
    """The vectors of step k: p, a0 and q0, where its matrices stand already."""
    s1, s2 = vector(stage, k, PULL), vector(stage, k, PULL + 3)
    if k + 1 < n:
        s1, s2 = plus(s1, vector(answer, k + 1, P1)), plus(s2, vector(answer, k + 1, P2))
    h1, h2 = plus(s1, vector(answer, k, H1)), plus(s2, vector(answer, k, H2))
    a0 = drive_of(push, target, k)
    y = plus(tv(matrix(stage, k, HP), h1), tv(matrix(stage, k, HV), h2))
    q0 = plus(y, sv(symmetric(answer, k, Y), a0))
    put3(answer, k, A0, a0)
    put3(answer, k, Q0, q0)
    if k == 0:
        return
    b = minus(a0, sv(symmetric(answer, k, W), q0))
    p1, p2 = tv(matrix(answer, k, Z1), b), tv(matrix(answer, k, Z2), b)
    p1 = p1[0] + h1[0], p1[1] + h1[1], p1[2] + h1[2] + stage[k, GX] * h1[0] + stage[k, GY] * h1[1]
    put3(answer, k, P1, p1)
    put3(answer, k, P2, plus(p2, plus(tv(matrix(stage, k, E), h1), tv(matrix(stage, k, V), h2))))


@part
def backward(stage, answer, push, inverse, target, top):
    """Both, from step `top` to the first; steps after `top` stand from an earlier pass."""
    n = len(stage)
    for k in range(top, -1, -1):
        factor_stage(stage, answer, push, inverse, k, n)
        vector_stage(stage, answer, push, target, k, n)


@part
def advance(stage, k, pose, twist, a):
    """(pose, twist) after step k under the drive a."""
    v = plus(mv(matrix(stage, k, V), twist), plus(mv(matrix(stage, k, HV), a), vector(stage, k, CV)))
    p = plus(mv(matrix(stage, k, E), twist), plus(mv(matrix(stage, k, HP), a), vector(stage, k, CP)))
    return (
        (p[0] + pose[0] + stage[k, GX] * pose[2], p[1] + pose[1] + stage[k, GY] * pose[2], p[2] + pose[2]),
        v,
    )


@part
def slope_of(answer, k, pose, twist):
    """g: slope of the cost by the drive of step k at the optimum."""
    q = plus(vector(answer, k, Q0), plus(mv(matrix(answer, k, Z1), pose), mv(matrix(answer, k, Z2), twist)))
    return minus(q, sv(symmetric(answer, k, Y), sv(symmetric(answer, k, W), q)))


@part
def forward(stage, answer, push, inverse, target, x, u):
    """Inputs u (n, wheels) and states x (n + 1, 6) of the optimum; row 0 of x is given."""
    pose, twist = vector(x, 0, 0), vector(x, 0, 3)
    for k in range(len(stage)):
        g = slope_of(answer, k, pose, twist)
        for i in range(u.shape[1]):
            u[k, i] = target[k, i] - inverse[k, i] * dot(column(push, i), g)
        pose, twist = advance(stage, k, pose, twist, drive_of(push, u, k))
        put3(x, k + 1, 0, pose)
        put3(x, k + 1, 3, twist)
