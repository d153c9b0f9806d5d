"""What `check` says: rows (columns and time), signal (single channels), wiring, scale (units, slip, lag), uses."""
