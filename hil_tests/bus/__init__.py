"""Ports: the tester's end of the bus, in virtual time or on a real interface."""
