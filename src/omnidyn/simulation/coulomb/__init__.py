"""Robots under Coulomb friction on the body axes or along the direction of travel: what `init` and `identify` write.

One compiled run gives values and derivatives in one pass. law: the numbers of such a robot, and which robots these are;
stage: one implicit stage and its derivatives; limits: motors that meet their current limit, or coast; events: stops and
reversals; state: what a run works in; step: one step; sampling: what sensors show between steps; run: steps of a
tolerance, cut at events, under voltages or behind a speed loop; door: from plants and voltages to a run.
"""
