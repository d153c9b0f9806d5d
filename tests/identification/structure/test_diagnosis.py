"""With what a diagnosis simulates a fit: the numbers of its best point, also where they stand in no parameter."""

import numpy as np

from omnidyn.identification.output_error.problem.parameters import robot_parameter
from omnidyn.identification.output_error.problem.problem import Point, Problem
from omnidyn.identification.structure.diagnosis import with_levels
from omnidyn.model.robot_file import load_robot


def test_axes_beside_a_level_of_breakaway_hold_what_they_slide_with_and_not_what_the_fit_began_from():
    """A first value above what was found would hold more than the fit had, and hide that the axis holds too little."""
    robot = load_robot("axebot")
    names = [f"friction.axes.coulomb[{axis}]" for axis in range(3)]
    problem = Problem(robot, tuple(robot_parameter(robot, name, None) for name in names), 3, ())
    found = 0.5 * np.array(robot.friction.axes.coulomb)
    point = Point(found, ())
    own = with_levels(problem, point, {"friction.axes.breakaway[0]": 3.0 * found[0]}).robot_at(point.values)
    np.testing.assert_allclose(own.friction.axes.breakaway, found * [3.0, 1.0, 1.0], rtol=1e-12)
    assert with_levels(problem, point, {}) is problem
