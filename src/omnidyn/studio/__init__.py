"""Studio: logs, fits and a robot to drive, in the browser. Read in this order.

worker (the process that does jobs, and how the server talks to it), job (what jobs share), series (long signals,
reduced to the pixels of a picture), guard (who may talk to the server), calls (a log, and the same by hand), parts,
removed (what undo brings back) and session (files and robot, shared by all pages), task (a job that a tab asked for),
words (what the library says, as a page says it), steps (what is done and what comes next), page and elements (what
the tabs of a page share), then a folder for each tab: log, robot, fit, drive, track, compare, each with its job (what
the library is asked for, in the worker), its state (shared by all pages) and its tab (buttons and tables), and live, a
log that is still recorded, and planned, a plan that is driven in the tab drive. Over them
workspace (all of it as one file), script (all of it as Python), jobs, layout and server (routes), and static/
(pictures on a canvas).
No formula and no sentence stands here: words come from the library's statements, numbers from its results.
"""

PORT = 8642  # where the server listens by default
