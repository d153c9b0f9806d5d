"""How sure: uncertainty, support (of nuisances), resampling, cures (of what the logs do not show), breakaway, levels,
no_fall."""
