"""Compiled marches through a piece of a log: march_sums, march_axis (the most common fit), counts (encoders), pull (a
force in the room)."""
