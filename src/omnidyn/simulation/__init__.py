"""How a robot moves under given commands.

simulate is the door; commands makes volts of what was commanded, speed_loop is the firmware's, view shows a run as a
log does; live is driven step by step. contract says what an engine is; engine has all of them and picks one: exact/ for
the paper's law, coulomb/ for friction of constant levels, slip/ for wheels that may slip, implicit/ for all others.
travel: what is kept of the turn and travel of a run. batch/ moves many robots at once. sensitivity/ gives the
derivatives of a run, band how far it may be off. environments/ for learning; friction_study: what the friction of a
robot does.
grip: which wheels lost their grip.
delays: commands and channels that are late.
"""
