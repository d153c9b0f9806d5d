"""Robots under Coulomb friction on the body axes or along the direction of travel: what `init` and `identify` write.

One compiled run gives values and derivatives in one pass. law: the numbers of such a robot, and which robots these are;
stage: one implicit stage and its derivatives; events: stops and reversals; run: steps of a tolerance, cut at events,
and what sensors show between them; door: from plants and voltages to a run.
"""
