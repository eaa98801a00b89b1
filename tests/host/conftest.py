"""What the tests of the host share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.lab import Lab


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    """A server with a client."""
    made = Lab(tmp_path)
    yield made
    made.client.close()
    made.server.close()
