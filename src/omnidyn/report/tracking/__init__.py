"""What closed loops look like: pictures (path, errors, voltages), animation (a GIF), page (all of it)."""
