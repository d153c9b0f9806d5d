"""Commands that drive a robot: track (closed loops side by side), tune (their gains)."""
