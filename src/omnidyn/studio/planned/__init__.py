"""A plan that is driven while a key is held, in the tab Drive. Read job, state, then card, which that tab shows."""
