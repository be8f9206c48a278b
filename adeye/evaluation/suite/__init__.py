"""What a suite of sensors can see and how fast it lets the vehicle go, without a simulation."""
