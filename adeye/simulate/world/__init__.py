"""The world of a batch of test cases: roads, objects, weather and the storyboard, as arrays.

No run goes on here from tick to tick: that is ``traffic``. Begin with ``compile``.
"""
