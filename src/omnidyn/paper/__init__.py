"""The paper as claims: tables (as printed), claim (our number, a verdict), a file per group, claims (all, in words)."""
