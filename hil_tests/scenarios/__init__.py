"""Scenarios: what is done to a device, as plain data that can be printed, stored and replayed.

Strategies make them up, a story plays them on a bench; what came of them is judged from the
trace like everything else.
"""
