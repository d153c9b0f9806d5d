"""Karnopp's band: an axis slower than Dv is at rest; momentum gathers while the drive exceeds what holds it.

    |w| < Dv:  v = 0, F = clip(drive, +-S), M w' = drive - F;   else v = w and the law of sliding

w is the momentum over the mass [m/s], a number of its own in a state where v = 0. An axis enters with the w it has, and
leaves at |w| = Dv: with a drive below S it stays for ever, to the last bit. Only body axes have it, each for itself.
Source: Karnopp 1985, with the pseudo-momentum of Armstrong-Helouvry et al. 1994.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES
from omnidyn.model.stick_slip.forces import forces_at_work

FIRM = 4.0  # times all forces at work: what an axis in its band is held with, whatever drives it


@part
def hold_in_band(plant, stage):
    """Let what is in its band be held by all it takes: who leaves it is no matter of forces."""
    element, each = plant.element, stage.each
    for a in range(N_AXES):
        own = element[a]
        if own.band > 0.0:
            each[a].hold[0], each[a].hold[1] = own.breakaway[0], own.breakaway[1]
    firm = FIRM * forces_at_work(plant, stage)
    for a in range(N_AXES):
        at = each[a]
        if element[a].band > 0.0 and at.sign == 0.0:
            at.hold[0] = at.hold[1] = firm


@part
def aim_band(stage, start, back):
    """Set w* of a stage, as currents have their i*."""
    for a in range(N_AXES):
        w = start.each[a].bend
        stage.each[a].aimed_bend = w + back * (stage.each[a].bend - w) if back != 0.0 else w


@part
def gather(plant, stage, tau):
    """w at the end of a stage that has been solved: what drives an axis at rest stands in the residual."""
    for a in range(N_AXES):
        own, at = plant.element[a], stage.each[a]
        at.bend = 0.0
        if own.band > 0.0 and at.sign == 0.0:
            drive = -stage.work.residual[a]
            excess = max(drive - own.breakaway[0], 0.0) - max(-drive - own.breakaway[1], 0.0)
            at.bend = at.aimed_bend + tau * excess / (plant.body.mass + plant.body.spin[a, a])


@part
def keep_band(stage, end):
    """Into a state: what has gathered."""
    for a in range(N_AXES):
        end.each[a].bend = stage.each[a].bend if stage.each[a].sign == 0.0 else 0.0


@part
def cross_band(plant, state):
    """Let axes enter and leave their bands, in place."""
    for a in range(N_AXES):
        width, now = plant.element[a].band, state.each[a]
        if width == 0.0 or now.sign == 2.0:
            continue
        if now.sign == 0.0 and abs(now.bend) >= width:
            state.x[a], now.sign, now.bend = now.bend, (1.0 if now.bend > 0.0 else -1.0), 0.0
        elif now.sign != 0.0 and abs(state.x[a]) < width:
            state.x[a], now.sign, now.bend = 0.0, 0.0, state.x[a]


@part
def crosses(plant, state):
    """Whether any axis of a state is to enter or to leave its band."""
    found = False
    for a in range(N_AXES):
        width, now = plant.element[a].band, state.each[a]
        if width > 0.0 and now.sign != 2.0:
            found |= abs(now.bend) >= width if now.sign == 0.0 else abs(state.x[a]) < width
    return found


@part
def band_error(one, two):
    """Difference of what has gathered in two states [m/s]."""
    worst = 0.0
    for a in range(N_AXES):
        worst = max(worst, abs(one.each[a].bend - two.each[a].bend))
    return worst
