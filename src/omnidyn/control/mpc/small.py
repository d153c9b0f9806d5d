"""Vectors of 3 and matrices of 3x3 as tuples of numbers, row by row: what a compiler keeps in registers.

Symmetric matrices are the six numbers xx, xy, xz, yy, yz, zz.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
ZERO_MATRIX = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@part
def vector(t, k, i):
    """Three entries of row k from column i."""
    return t[k, i], t[k, i + 1], t[k, i + 2]


@part
def matrix(t, k, i):
    """Nine entries of row k from column i."""
    return (
        t[k, i],
        t[k, i + 1],
        t[k, i + 2],
        t[k, i + 3],
        t[k, i + 4],
        t[k, i + 5],
        t[k, i + 6],
        t[k, i + 7],
        t[k, i + 8],
    )


@part
def symmetric(t, k, i):
    """Six entries of row k from column i."""
    return t[k, i], t[k, i + 1], t[k, i + 2], t[k, i + 3], t[k, i + 4], t[k, i + 5]


@part
def put3(t, k, i, v):
    """Write a vector into row k from column i."""
    t[k, i], t[k, i + 1], t[k, i + 2] = v


@part
def put6(t, k, i, v):
    """Write six numbers into row k from column i."""
    t[k, i], t[k, i + 1], t[k, i + 2], t[k, i + 3], t[k, i + 4], t[k, i + 5] = v


@part
def put9(t, k, i, v):
    """Write a matrix into row k from column i."""
    (
        t[k, i],
        t[k, i + 1],
        t[k, i + 2],
        t[k, i + 3],
        t[k, i + 4],
        t[k, i + 5],
        t[k, i + 6],
        t[k, i + 7],
        t[k, i + 8],
    ) = v


@part
def plus(a, b):
    """a + b of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part
def minus(a, b):
    """a - b of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@part
def dot(a, b):
    """a . b of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def transposed(a):
    """a^T."""
    return a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]


@part
def added(a, b):
    """a + b of two matrices."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@part
def scaled(a, c):
    """c a of a matrix."""
    return c * a[0], c * a[1], c * a[2], c * a[3], c * a[4], c * a[5], c * a[6], c * a[7], c * a[8]


@part
def full(s):
    """A symmetric matrix written out."""
    return s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]


@part
def mv(a, v):
    """a v."""
    return (
        a[0] * v[0] + a[1] * v[1] + a[2] * v[2],
        a[3] * v[0] + a[4] * v[1] + a[5] * v[2],
        a[6] * v[0] + a[7] * v[1] + a[8] * v[2],
    )


@part
def tv(a, v):
    """a^T v."""
    return (
        a[0] * v[0] + a[3] * v[1] + a[6] * v[2],
        a[1] * v[0] + a[4] * v[1] + a[7] * v[2],
        a[2] * v[0] + a[5] * v[1] + a[8] * v[2],
    )


@part
def sv(s, v):
    """s v, s symmetric."""
    return (
        s[0] * v[0] + s[1] * v[1] + s[2] * v[2],
        s[1] * v[0] + s[3] * v[1] + s[4] * v[2],
        s[2] * v[0] + s[4] * v[1] + s[5] * v[2],
    )


@part
def mm(a, b):
    """a b."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@part
def tm(a, b):
    """a^T b."""
    return (
        a[0] * b[0] + a[3] * b[3] + a[6] * b[6],
        a[0] * b[1] + a[3] * b[4] + a[6] * b[7],
        a[0] * b[2] + a[3] * b[5] + a[6] * b[8],
        a[1] * b[0] + a[4] * b[3] + a[7] * b[6],
        a[1] * b[1] + a[4] * b[4] + a[7] * b[7],
        a[1] * b[2] + a[4] * b[5] + a[7] * b[8],
        a[2] * b[0] + a[5] * b[3] + a[8] * b[6],
        a[2] * b[1] + a[5] * b[4] + a[8] * b[7],
        a[2] * b[2] + a[5] * b[5] + a[8] * b[8],
    )


@part
def tms(a, b):
    """a^T b where that is symmetric."""
    return (
        a[0] * b[0] + a[3] * b[3] + a[6] * b[6],
        a[0] * b[1] + a[3] * b[4] + a[6] * b[7],
        a[0] * b[2] + a[3] * b[5] + a[6] * b[8],
        a[1] * b[1] + a[4] * b[4] + a[7] * b[7],
        a[1] * b[2] + a[4] * b[5] + a[7] * b[8],
        a[2] * b[2] + a[5] * b[5] + a[8] * b[8],
    )


@part
def sm(s, b):
    """s b, s symmetric."""
    return (
        s[0] * b[0] + s[1] * b[3] + s[2] * b[6],
        s[0] * b[1] + s[1] * b[4] + s[2] * b[7],
        s[0] * b[2] + s[1] * b[5] + s[2] * b[8],
        s[1] * b[0] + s[3] * b[3] + s[4] * b[6],
        s[1] * b[1] + s[3] * b[4] + s[4] * b[7],
        s[1] * b[2] + s[3] * b[5] + s[4] * b[8],
        s[2] * b[0] + s[4] * b[3] + s[5] * b[6],
        s[2] * b[1] + s[4] * b[4] + s[5] * b[7],
        s[2] * b[2] + s[4] * b[5] + s[5] * b[8],
    )


@part
def gain_of(y, c):
    """W = (I + C Y)^-1 C = C - C (Y^-1 + C)^-1 C for symmetric Y, C >= 0, singular ones too.

    C = L L^T with zeros where a pivot vanishes; I + L^T Y L has no eigenvalue below 1; W = L (I + L^T Y L)^-1 L^T.
    """
    tiny = 1e-13
    l00 = c[0] ** 0.5
    r0 = 1.0 / l00 if c[0] > 0.0 else 0.0
    l10, l20 = c[1] * r0, c[2] * r0
    p1 = c[3] - l10 * l10
    p1 = p1 if p1 > tiny * c[3] else 0.0
    l11 = p1**0.5
    r1 = 1.0 / l11 if p1 > 0.0 else 0.0
    l21 = (c[4] - l20 * l10) * r1
    p2 = c[5] - l20 * l20 - l21 * l21
    l22 = p2**0.5 if p2 > tiny * c[5] else 0.0
    # Y L, then I + L^T Y L
    a0 = y[0] * l00 + y[1] * l10 + y[2] * l20
    a1 = y[1] * l00 + y[3] * l10 + y[4] * l20
    a2 = y[2] * l00 + y[4] * l10 + y[5] * l20
    b1, b2 = y[3] * l11 + y[4] * l21, y[4] * l11 + y[5] * l21
    m00 = 1.0 + l00 * a0 + l10 * a1 + l20 * a2
    m10, m20 = l11 * a1 + l21 * a2, l22 * a2
    m11, m21 = 1.0 + l11 * b1 + l21 * b2, l22 * b2
    m22 = 1.0 + l22 * (y[5] * l22)
    # M = U D U^T, unit lower triangular U
    d0 = 1.0 / m00
    u10, u20 = m10 * d0, m20 * d0
    d1 = 1.0 / (m11 - u10 * m10)
    v21 = m21 - u20 * m10
    u21 = v21 * d1
    d2 = 1.0 / (m22 - u20 * m20 - u21 * v21)
    # X = U^-1 L^T: rows; W = X^T D^-1 X
    x00, x01, x02 = l00, l10, l20
    x10, x11, x12 = -u10 * x00, l11 - u10 * x01, l21 - u10 * x02
    x20 = -u20 * x00 - u21 * x10
    x21 = -u20 * x01 - u21 * x11
    x22 = l22 - u20 * x02 - u21 * x12
    return (
        x00 * d0 * x00 + x10 * d1 * x10 + x20 * d2 * x20,
        x00 * d0 * x01 + x10 * d1 * x11 + x20 * d2 * x21,
        x00 * d0 * x02 + x10 * d1 * x12 + x20 * d2 * x22,
        x01 * d0 * x01 + x11 * d1 * x11 + x21 * d2 * x21,
        x01 * d0 * x02 + x11 * d1 * x12 + x21 * d2 * x22,
        x02 * d0 * x02 + x12 * d1 * x12 + x22 * d2 * x22,
    )


@part
def inverse(a):
    """a^-1 of a matrix."""
    c0, c1, c2 = a[4] * a[8] - a[5] * a[7], a[5] * a[6] - a[3] * a[8], a[3] * a[7] - a[4] * a[6]
    r = 1.0 / (a[0] * c0 + a[1] * c1 + a[2] * c2)
    return (
        c0 * r,
        (a[2] * a[7] - a[1] * a[8]) * r,
        (a[1] * a[5] - a[2] * a[4]) * r,
        c1 * r,
        (a[0] * a[8] - a[2] * a[6]) * r,
        (a[2] * a[3] - a[0] * a[5]) * r,
        c2 * r,
        (a[1] * a[6] - a[0] * a[7]) * r,
        (a[0] * a[4] - a[1] * a[3]) * r,
    )
