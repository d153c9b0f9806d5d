"""Parts of kernels are code to link: one that Python calls is compiled for itself, in every process anew (a second)."""

import pytest

from omnidyn.compiled.kernel import Linked
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy

AXEBOT = load_robot("axebot")
BREAKAWAY = tuple(1.5 * level for level in AXEBOT.friction.axes.coulomb)
FALL = {"breakaway": BREAKAWAY, "stribeck_speed": (0.02, 0.02, 0.2)}
BRISTLES = {"stiffness": (1e4, 1e4, 1e2), "damping": (10.0, 10.0, 1.0)}


def on_axes(**changed):
    return AXEBOT.replace(friction=AXEBOT.friction.replace(axes=AXEBOT.friction.axes.replace(**changed)))


ROBOTS = {
    "Stribeck": on_axes(**FALL),
    "Lorentzian": on_axes(**FALL, stribeck_shape="lorentzian"),
    "LuGre": on_axes(law="lugre", **FALL, **BRISTLES),
    "elasto-plastic": on_axes(law="elastoplastic", **BRISTLES),
    "Karnopp": on_axes(law="karnopp"),
    "ellipse": AXEBOT.replace(
        friction=Friction(
            axes=AxesFriction(viscous=(0.0, 0.0, 0.01), coulomb=(0.0, 0.0, 0.1)),
            direction=DirectionFriction(coulomb=(2.0, 1.5), breakaway=(3.0, 2.0), stribeck_speed=0.02),
        )
    ),
    "slip": AXEBOT.replace(wheels=AXEBOT.wheels.replace(traction_mu=0.3, wheel_inertia=1e-5)),
}


@pytest.fixture
def _linked_only(monkeypatch):
    def called(part, *_):
        raise AssertionError(f"{part.py_func.__qualname__} is called from Python")

    monkeypatch.setattr(Linked, "__call__", called)


@pytest.mark.usefixtures("_linked_only")
@pytest.mark.parametrize("name", ROBOTS)
def test_a_simulation_calls_kernels_alone(name):
    simulate(ROBOTS[name], [[0.0, 3.0, -3.0]] * 20, 0.01)


@pytest.mark.usefixtures("_linked_only")
def test_a_diagnosis_calls_kernels_alone():
    """It tries a fall and bristles, which the robot has not."""
    estimate = identify(
        noisy(simulate(AXEBOT, excitation(5.0, 100.0, 3), 0.01), 4), AXEBOT, OutputError(nuisances=())
    ).estimate
    assert estimate.lack_of_fit is not None
    assert not estimate.lack_of_fit.found
