"""Tab Drive: a robot driven by hand, and recorded. Read job, state, then tab."""
