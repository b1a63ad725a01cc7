"""What readings show of units, axes and channels: by gravity in few chips, by the rigid body in many."""
