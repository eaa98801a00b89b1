"""Hosts a node in real time: the one part of `node_model` that does input and output.

`loop` keeps the node's time, `wires` reach the bus, `control` serves the bench control
protocol, `verbs` and `jobs` carry out what it asks for, `command` is the command line.
"""
