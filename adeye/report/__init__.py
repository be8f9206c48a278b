"""Reports on a campaign: one HTML page, its machine twin in JSON, and JUnit XML for CI.

Nothing here executes a run: who wants replays drawn gives the function for it. Begin with
``build``. Called itself, it is the public function of its name.
"""

from adeye.called import call_as_function

call_as_function(__name__)
