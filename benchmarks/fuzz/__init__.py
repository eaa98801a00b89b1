"""Fuzzing of the device models: any frames, in virtual time, and what must hold all the same."""
