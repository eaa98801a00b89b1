"""Exploring a device in virtual time: seeded walks for volume, shrinking, distilling a corpus.

A finding is a scenario: one line that plays again anywhere, on the model and on a board.
"""
