"""Is a model with one more effect better? blocks: by the errors of blocks that neither fit has seen."""
