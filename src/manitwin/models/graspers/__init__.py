"""Where a gripper may hold an object: proposals, before any physics."""
