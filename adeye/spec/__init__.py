"""What users write: ODD, scenario, architecture, concept and faults, as frozen typed records.

Nothing is counted or simulated here. Begin with ``load``.
"""
