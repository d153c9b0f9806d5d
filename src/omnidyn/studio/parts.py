"""Parts of the session that change, by which a page knows what to make again."""

LOGS, ROBOT, FIT, PROGRESS = "logs", "robot", "fit", "progress"
DRIVE, VIEW, NUMBERS = "drive", "view", "numbers"  # the drive: its buttons, the robot, the numbers of the robot
