"""Episodes: planning, execution in simulation, judging and recording of manipulation skills."""
