"""Channels that are programs: the protocol, its host, the warden of the children.

What a channel decides is never here. Begin with ``channel``.
"""
