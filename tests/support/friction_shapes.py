"""The paper's robot with every shape of friction and mixtures of them, for tests of the implicit engine."""

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot_file import load_robot

AXEBOT = load_robot("axebot")
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099)}
YAW = {"yaw_coulomb": 0.099, "yaw_viscous": 0.01}
SHAPES = {
    "axes": Friction(axes=AxesFriction(**LEVELS)),
    "axes, breakaway": Friction(axes=AxesFriction(**LEVELS, breakaway=(3.0, 2.0, 0.13))),
    "disc": Friction(direction=DirectionFriction(coulomb=(2.0, 2.0), viscous=0.9, **YAW)),
    "ellipse": Friction(direction=DirectionFriction(coulomb=(2.2, 1.4), viscous=0.9, **YAW)),
    "ellipse, breakaway": Friction(
        direction=DirectionFriction(coulomb=(2.2, 1.4), breakaway=(2.9, 1.8), yaw_breakaway=0.13, **YAW)
    ),
    "wheels": Friction(wheels=WheelFriction(coulomb=(0.8, 0.7, 0.9), coulomb_backward=0.6, viscous=0.3)),
    "wheels, breakaway": Friction(wheels=WheelFriction(coulomb=0.8, breakaway=1.1, viscous=0.3)),
    "axes and wheels": Friction(
        axes=AxesFriction(viscous=(0.5, 0.5, 0.005), coulomb=(1.1, 0.8, 0.05)), wheels=WheelFriction(coulomb=0.5)
    ),
    "ellipse and wheels": Friction(
        direction=DirectionFriction(coulomb=(1.2, 0.8), **YAW), wheels=WheelFriction(coulomb=(0.5, 0.4, 0.6))
    ),
    "all": Friction(
        axes=AxesFriction(viscous=(0.3, 0.3, 0.003), coulomb=(0.8, 0.6, 0.03), breakaway=(1.0, 0.7, 0.04)),
        direction=DirectionFriction(coulomb=(0.8, 0.6), breakaway=(1.0, 0.9), yaw_coulomb=0.03),
        wheels=WheelFriction(coulomb=0.3, breakaway=0.4, viscous=0.1),
    ),
}


def shaped(shape, **motor):
    """The paper's robot in a turning frame with another friction and other motors."""
    return AXEBOT.replace(
        body=AXEBOT.body.replace(rotating_frame=True),
        motor=AXEBOT.motor.replace(**motor),
        friction=SHAPES[shape],
    )


def implicit(robot):
    """The same robot, left to the general engine by brushes that drop next to nothing."""
    return robot.replace(motor=robot.motor.replace(voltage_drop=1e-14))
