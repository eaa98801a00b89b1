"""The master's side of SDO and LSS, without input and output.

What a client would send next is a function of what came back. Who carries the frames, and
how long an answer may take, is the affair of `hil_tests.bench`.
"""
