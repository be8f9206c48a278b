"""The verbs that read results: a run, a campaign, what more executions of it tell.

None of them changes a result that is stored. Begin with ``show``.
"""
