"""Judging: what was seen against what the clause allows, with the doubt of both.

No pytest, no clock, no bus: everything here is a function of a trace and of requirements,
so that a verdict can be recomputed from a recording alone.
"""
