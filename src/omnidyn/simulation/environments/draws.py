"""Random numbers of environments: a hash of (key of the robot, episode, number of the draw), and nothing else.

So a robot draws the same in a batch of any size, by any number of threads, and after any resets of others.

    x ^= x >> 16;  x *= 0x21F0AAAD;  x ^= x >> 15;  x *= 0x735A2D97;  x ^= x >> 15      of 32 bits

The hash is lowbias32 with the multipliers of T. Ettinger (hash-prospector). They are below 2^31: no product of 64 bits
overflows, in compiled code as in Python.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part

MASK = 0xFFFFFFFF
GOLDEN = 0x1E3779B9
TO_ONE = 2.0**-31  # of 32 bits, seen from their middle


@part
def mixed(x):
    """The hash of a number of 32 bits."""
    x = ((x ^ (x >> 16)) * 0x21F0AAAD) & MASK
    x = ((x ^ (x >> 15)) * 0x735A2D97) & MASK
    return x ^ (x >> 15)


@part
def draw(key, episode, k):
    """32 random bits: draw k of an episode."""
    return mixed(mixed((key + GOLDEN * (episode & MASK)) & MASK) ^ (k & MASK))


@part
def uniform(key, episode, k):
    """A number from -1 up to 1, without 1 itself."""
    return (draw(key, episode, k) - 0x80000000) * TO_ONE


@part
def robot_key(seed, robot):
    """The key of a robot by its number in the batch. seed: of 32 bits."""
    return mixed((mixed(seed) + GOLDEN * robot) & MASK)
