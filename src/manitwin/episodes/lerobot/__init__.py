"""LeRobotDataset v3.0: writer of episodes, and a reader that checks what LeRobot's own reader relies on."""
