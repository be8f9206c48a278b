"""Reports on a campaign: one HTML page, its machine twin in JSON, and JUnit XML for CI."""
