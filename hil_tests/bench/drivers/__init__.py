"""Drivers: how a facility of a real bench is moved (control protocol, operator, ...)."""
