"""What users write: ODD, scenario, architecture, concept and faults, as frozen typed records."""
