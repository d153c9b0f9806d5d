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
LAWS = 23  # 0 where no level depends on the speed and nothing has a memory: then what follows is not read
STEEP = 24  # [1/s] bound of the rate at which friction that falls with the speed lets a body run away
BRISTLES = 25  # the sum of the levels of all bristles [N]; 0 where there are none
GATHERS = 26  # 1 where an axis gathers momentum in Karnopp's band
FALL_XY = 27  # of the ellipse, what FALL and its neighbours are of an element; its bristle bends along x and y
ROOM, FACING = 40, 42  # [N] constant force along x and y of the room; heading at the start of a step [rad]
BODY_SIZE = 43

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
FALL, EXPONENT = 26, 27  # Stribeck: 1/speed [s/m], 0 where the level does not fall; exponent
STIFF, DAMP, FADE, SHAPE = 28, 29, 30, 31  # of a bristle: [N/m], 0 where there is none; [N s/m]; 1/speed; Dahl's
BEND_SLIDE, BEND_HOLD = 32, 34  # levels of a bristle [N], as SLIDE and HOLD are of what sticks
AIMED, BENT = 36, 37  # [m] z* and z at the solution; in Karnopp's band the speed gathered against it [m/s]
BAND = 38  # Karnopp's speed [m/s], 0 for none
KEEP = BEND_SLIDE  # what the band keeps at rest [N], forward and (+1) backward: no bristle is there
ELEMENT_SIZE = 40
OPEN = 0.0
# of the ellipse, in the body: the columns above, from FALL_XY on
EXPONENT_XY, STIFF_XY, DAMP_XY, FADE_XY = FALL_XY + 1, FALL_XY + 2, FALL_XY + 3, FALL_XY + 4
BEND_SLIDE_XY, BEND_HOLD_XY, AIMED_XY, BENT_XY = FALL_XY + 5, FALL_XY + 7, FALL_XY + 9, FALL_XY + 11
