"""One file per schema version after the first; a released one is never edited."""
