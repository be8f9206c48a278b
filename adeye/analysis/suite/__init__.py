"""What the sensors of an architecture see, and how fast that lets the ego go.

Nothing is simulated here. Begin with ``analyse``.
"""
