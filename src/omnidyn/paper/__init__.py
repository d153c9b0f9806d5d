"""The paper as claims: tables (as printed), claim (our number and a verdict), one file per group, claims (all)."""
