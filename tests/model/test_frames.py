"""Body and world frame, eqs (1) (2), against REP-103: x forward, y left, yaw counter-clockwise."""

import numpy as np
import pytest

from omnidyn.model.frames import body_to_world, world_to_body


@pytest.mark.parametrize(
    "heading_deg, twist, world",
    [
        (0.0, (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)),
        (90.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),  # it looks along world y and drives forward
        (90.0, (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)),  # and to its left
        (180.0, (1.0, 2.0, 3.0), (-1.0, -2.0, 3.0)),
        (30.0, (2.0, 0.0, 0.0), (np.sqrt(3.0), 1.0, 0.0)),
    ],
)
def test_a_body_twist_in_the_world(heading_deg, twist, world):
    got = body_to_world(np.radians(heading_deg)) @ np.array(twist)
    np.testing.assert_allclose(got, world, atol=1e-15)


def test_eq_2_as_printed():
    theta = 0.7
    cos, sin = np.cos(theta), np.sin(theta)
    printed = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_array_equal(world_to_body(theta), printed)


def test_there_and_back_for_a_batch():
    headings = np.linspace(-7.0, 7.0, 12).reshape(3, 4)
    both = world_to_body(headings) @ body_to_world(headings)
    assert both.shape == (3, 4, 3, 3)
    np.testing.assert_allclose(both, np.broadcast_to(np.eye(3), both.shape), atol=1e-15)
