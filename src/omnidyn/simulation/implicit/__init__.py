"""Every other law: one implicit step (step) whose stages are inclusions, and a run of them (implicit_march)."""
