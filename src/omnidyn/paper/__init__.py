"""The paper as claims: tables (as printed), claim (our number, a verdict), claims (all, in words). A file per group:
geometry, motion, motors, steady (where the model settles), speeds, friction, validation, mismatch, reconcile (what
would make its tables agree). experiments: those behind its tables and figures, simulated. voltage_programs: what one
applies to learn how a robot moves."""
