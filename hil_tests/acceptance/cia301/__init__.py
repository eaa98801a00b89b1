"""Acceptance tests of CiA 301 and CiA 305 for every device with an object dictionary."""
