"""How sure: uncertainty, rounding, support (of nuisances), resampling,
breakaway, no_fall."""
