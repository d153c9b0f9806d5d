"""What all pieces of a problem have in common."""

import numpy as np

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate


def test_it_is_found_once_however_many_pieces_there_are():
    """Each piece asks for it at each point: found anew, a fit took as long as the square of the number of logs."""
    robot = load_robot("axebot")
    run = simulate(robot, np.tile([[3.0, -3.0, 0.0], [-2.0, 1.0, 2.0]], (50, 1)), 0.02)
    question = OutputError(free=("friction.axes.coulomb[0]", "body.mass_kg"), outputs=("twist",), nuisances=())
    problem = make_problem(read_records([run, run], robot, question), robot, question)
    assert problem.columns == (("twist", 0), ("twist", 1), ("twist", 2))
    assert problem.columns is problem.columns
    assert problem.tick is problem.tick
    assert problem.names is problem.names
    assert [problem.where(name) for name in (*problem.names, "no such name")] == [*range(len(problem.names)), -1]
