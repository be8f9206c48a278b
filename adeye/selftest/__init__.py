"""The self-test: known-bad masters through plan, run, judge, store and exit code."""
