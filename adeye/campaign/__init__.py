"""Campaigns: plan what an ODD asks for, execute what is missing, judge, store, reproduce."""
