"""Sensor models: ground truth in, what each sensor would deliver out.

No track and no channel is known here. Begin with ``rig``.
"""
