"""What it takes to test a CANopen device."""
