"""Tab Fit: from logs to a robot. Read job, state, then tab."""
