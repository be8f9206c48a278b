"""What a recorded run means: metrics, signal temporal logic, verdicts."""
