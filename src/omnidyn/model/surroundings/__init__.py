"""Where a robot stands, and what its file knows by name: its floor, loads, batteries. vary (varied/) applies them."""
