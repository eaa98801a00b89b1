"""What all tests of the project's own code share: how Hypothesis explores.

No deadline: a busy host must not fail a test. In CI the examples are the same each time, so
that a change is judged by what it changed; elsewhere each run explores anew.
"""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile(
    "own-code", deadline=None, derandomize="CI" in os.environ, print_blob=True
)
settings.load_profile("own-code")
