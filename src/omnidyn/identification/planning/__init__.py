"""Which experiment? A program of moves inside a room, and how well each number will be known after it.

moves (what a robot may be asked to do), recorded (what it does then, and what its sensors log), information (what a log
tells of each number: the fit's own problem), aims (what is to be told best), limits (battery, motors, grip), search
(which moves), planned (the result), plan (the door), got (what it promised, beside a fit), rig (one motor on a bench).
"""
