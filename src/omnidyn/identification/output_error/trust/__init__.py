"""How sure: uncertainty, support (of nuisances), resampling, cures (of what the logs do not show), breakaway, levels,
no_fall. blind_directions: directions that logs do not tell. level_search: the search for likely levels. tied_numbers:
one number tied to another. group_differences: what differs between groups. search_ends: numbers at the ends of their
search. rounding_scatter: the spread of a fit to counts without noise."""
