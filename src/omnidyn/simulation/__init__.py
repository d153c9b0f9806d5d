"""How a robot moves under given commands.

simulate is the door; commands makes volts of what was commanded, speed_loop is the firmware's, view shows a run
as a log does. Two engines: exact/ for the paper's law, implicit/ for all others.
sensitivity/ gives the derivatives of a run, band how far it may be off.
"""
