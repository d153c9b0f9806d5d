"""Tab Robot: choose, describe, view, edit, rename and remove robots. Read job, make, rename, then tab."""
