"""The self-test: known-bad masters through plan, run, judge, store and exit code.

Nothing that a campaign needs is here. Begin with ``running``.
"""
