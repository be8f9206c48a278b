"""Campaigns: plan what an ODD asks for, execute what is missing, judge, store, reproduce.

No tick is simulated here, no metric defined and no SQL written. Begin with ``run``.
"""
