"""A log that is still recorded: what it tells while it grows. Read job, state, then strip, which the tab Log shows."""
