"""vary: a robot under another load, on another floor, with another battery."""
