"""What it takes to test a CANopen device: ports, bench, judge, acceptance tests, plugin."""
