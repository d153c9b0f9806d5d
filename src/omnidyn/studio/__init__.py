"""Studio: logs, fits and a robot to drive, in the browser. Read in this order.

jobs and driving (what the library is asked for), worker (the process that does jobs, and how the server talks to it),
series (long signals, reduced to the pixels of a picture), guard (who may talk to the server), calls (a log, and the
same by hand), session (files, robot and results, shared by all pages), elements and page (tabs and buttons), server
(routes), static/ (pictures on a canvas).
No formula and no sentence stands here: words come from the library's statements, numbers from its results.
"""

PORT = 8642  # where the server listens by default
