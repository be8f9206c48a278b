"""From what users write to test cases: designs, constraints and expansion."""
