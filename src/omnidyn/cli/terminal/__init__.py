"""What every command shares: streams (out and err), numbers, session (provenance), progress."""
