"""Episodes as a LeRobotDataset v3.0: its writer, and a reader that checks what LeRobot's own relies on."""
