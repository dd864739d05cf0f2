"""Hands of robots as episodes close and open them: jaws, fingers with joints, a suction cup."""
