"""From what users write to test cases: designs, constraints and expansion.

Nothing is simulated here, and no test case is made before somebody asks for it. Begin with
``expand``.
"""
