"""Tab Track: controllers side by side on one path, named, from a file or drawn. Read job, state, then tab."""
