"""What it takes to be a CANopen device, and the wire between devices.

Pure Python without input, output, clock or chance: a device model is told the time and
the frames, and answers with frames. The one module that touches the outside is the host.
"""
