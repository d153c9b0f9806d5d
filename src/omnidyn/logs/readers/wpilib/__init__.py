"""WPILib data logs (.wpilog): wpilog (records, entries, the reader) and structs (values that are made of several)."""
