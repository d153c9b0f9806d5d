"""Compiled marches through a piece of a log: march, march_axis (the most common fit), counts (encoders),
of_rows (what rows of other engines add up to), pull (a force in the room)."""
