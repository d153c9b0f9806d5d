"""Parts of the session that change, by which a page knows what to make again."""

LOGS, ROBOT, FIT, PROGRESS = "logs", "robot", "fit", "progress"
FREE = "free"  # what can be free of the robot
DRIVE, VIEW, NUMBERS = "drive", "view", "numbers"  # the drive: its buttons, the robot, the numbers of the robot
TRACK, PATH, TRACK_START = "track", "path", "track start"  # what controllers did; their path; the button
COMPARE, DRIFT, COMPARE_START = "compare", "drift", "compare start"  # robots over logs; fits; their buttons
PLAN, COURSE, BARS = "plan", "course", "bars"  # a plan to drive: its buttons; what is driven now; what that tells
WATCH, LIVE = "watch", "live"  # a log that grows: its buttons; what it tells
FITTED, HELD_OUT, LEFT_OUT = "fit", "hold out", "leave out"  # what a log is used for
ROBOT_FILE = "robot.toml"  # of a fit, in its folder
