"""The layout of the two tables that a Plant is: names of the entries of `body` and of the columns of `element`.

Yaw is measured as length, rho = sqrt(I/M) of the body, so that the body has the mass M in all directions and all
forces are in newtons. What spins adds its own mass, which couples the directions where wheels differ.
An element is where dry friction acts on one scalar speed: rows 0..2 are the body axes, 3.. the wheels. The ellipse of
the direction of travel acts on (v_x, v_y) as a whole.
"""

N_AXES, YAW = 3, 2  # the first rows are the body axes; the row of yaw

# Body: entries of a vector. The first are the robot's, the rest belong to the problem being solved.
MASS, LENGTH, TURNING = 0, 1, 2  # M of the body [kg]; rho [m]; M/rho where the body frame turns, else 0
SLIDE_X, SLIDE_Y, HOLD_X, HOLD_Y = 3, 4, 5, 6  # the ellipse, Coulomb and breakaway levels [N]
ELLIPSE = 7  # its sign: 1 slides, 0 stuck, 2 there is none
TAU, GOAL, PUSH = 8, 9, 12  # length of the stage [s]; x* [m/s], 3 entries; constant wrench [N], 3 entries
MEMORY = 15  # [s] in which the slowest motion fades to 1/e, dry friction apart; (+1) where motors let go
SPIN = 17  # [kg] what rotors and wheels add to the mass: entries xx, yy, zz, xy, xz, yz of a symmetric matrix
BODY_SIZE = 23

# Element: columns of a table with one row per element.
GX, GY, GZ, VISCOUS = 0, 1, 2, 3  # local speed = g . x; [N s/m]
SLIDE, HOLD = 4, 6  # Coulomb and breakaway level [N]: against forward motion, and (+1) against backward motion
ACTIVE = 8  # 1 when the element can stick
THRUST, EMF = 9, 10  # of a motor, at the rim of its wheel: force per ampere [N/A]; back-EMF [V s/m]
RESISTANCE, INDUCTANCE, DROP, LIMIT, EFFICIENCY = 11, 12, 13, 14, 15  # of a motor and its gear
SIGN = 16  # 1 and -1 slide forward and backward, 0 stuck, 2 no dry friction
VOLTAGE, BOUND, NOW, CURRENT = 17, 18, 19, 20  # applied [V]; current limit in force [A]; i* and i at the solution [A]
LOSS, FOUND, BEFORE = 21, 23, 24  # gear loss at rest [N], forward and (+1) backward; marks of the solver
BRANCH = 25  # of the current, as winding_branch tells it; OPEN: found at the solution
ELEMENT_SIZE = 26
OPEN = 0.0
