"""The drive: a small axis with the communication services of CiA 301."""

from node_model.drive.drive import Drive, DriveParts
from node_model.drive.profile import Factory, Profile, loads

__all__ = ["Drive", "DriveParts", "Factory", "Profile", "loads"]
