"""Tab Robot: the robots of the session: choose, describe, view, edit, rename, remove. Read job, make, rename, then tab."""
