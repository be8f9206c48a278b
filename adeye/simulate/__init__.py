"""The closed loop: a batch of test cases becomes a trace.

World, traffic, sensors, channels, faults and switch are its stages. Nothing here judges, stores
or prints. Begin with ``engine.run``, which drives the stages in their order.
"""
