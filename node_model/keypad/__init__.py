"""The keypad: a CANopen node with keys and LEDs that is commissioned over the bus."""

from node_model.keypad.keypad import Keypad, Parts
from node_model.keypad.parameters import Parameters
from node_model.keypad.profile import Profile, load, loads

__all__ = ["Keypad", "Parameters", "Parts", "Profile", "load", "loads"]
