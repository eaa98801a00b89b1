"""Acceptance tests of a drive: SYNC and synchronous PDOs, emergency messages and errors."""
