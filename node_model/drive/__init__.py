"""The drive: a small axis with the communication services of CiA 301."""

from node_model.drive.axis import Axis
from node_model.drive.drive import Drive, DriveParts
from node_model.drive.profile import Profile, loads

__all__ = ["Axis", "Drive", "DriveParts", "Profile", "loads"]
