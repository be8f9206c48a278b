"""Other people's systems: what they say of themselves, and programs that drive them.

Which part of a run such a system is, is never here: channels, vehicles and sensors stand in their
own rooms, and how programs are started and watched in ``channels/process``. Begin with ``fmi``.
"""
