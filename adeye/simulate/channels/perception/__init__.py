"""What channels make of measurements: tracks, the place of the ego, clusters.

No decision about driving is here. Begin with ``step``.
"""
