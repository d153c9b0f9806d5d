"""Compiled marches through a piece of a log: march, march_axis (the most common fit), counts (encoders), pull (a force
in the room)."""
