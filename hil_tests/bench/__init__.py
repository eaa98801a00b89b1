"""The bench: what a test can do to the device, whatever stands behind it."""
