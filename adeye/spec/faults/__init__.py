"""The models of faults, by what they are faults of; ``adeye.spec.fault`` reads any of them."""
