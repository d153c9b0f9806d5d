"""Names of the columns of the tables of the quadratic program, one row per step of the horizon.

`stage`: twist+ = V twist + HV a + CV,  pose+ = (I + turn) pose + E twist + HP a + CP,  a = B u the drive [m/s^2].
turn: a change of heading moves x and y by (GX, GY). WEIGHT, PULL: cost 1/2 x^T diag(WEIGHT) x + PULL . x of the state
after the step, pose first. WAY: back to the path, as a speed in the body frame. All 3x3 matrices row by row.
`answer`: what one backward pass leaves: P, p of the cost to go before the step, and what the forward pass needs.
"""

from __future__ import annotations

V, E, HV, HP, CV, CP, GX, GY, WEIGHT, PULL, WAY, STAGE_SIZE = 0, 9, 18, 27, 36, 39, 42, 43, 44, 50, 56, 59

P11, P12, P22, P1, P2 = 0, 6, 15, 21, 24  # cost to go 1/2 x^T P x + p . x: blocks of pose and twist
Z1, Z2, Y, W, A0, Q0, H1, H2 = 27, 36, 45, 51, 57, 60, 63, 66
ANSWER_SIZE = 69
